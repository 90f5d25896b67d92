"""Under variation each robot, each measurement and each command is drawn by itself, as `Variation` describes."""

import numpy as np
import numpy.typing as npt
import pytest

from batch import test_roboflag, test_sharks_and_minnows
from batch.refereeing import smaller
from vrg_learn.batch import motion, stepping
from vrg_learn.batch.matches import Batch
from vrg_learn.batch.stepping import Variation

VARY = Variation(speed=0.1, acceleration=0.2, turning=0.3, position_noise=0.05, heading_noise=0.02, delay=9, loss=0.4)
SHARKS = test_sharks_and_minnows.SMALL
TWO = smaller(test_roboflag.SETUP, ("red1", "blue1"))
Floats = npt.NDArray[np.float64]


def dependence(columns: Floats) -> float:
    """The largest correlation of two columns."""
    return float(np.abs(np.corrcoef(columns, rowvar=False) - np.eye(columns.shape[1])).max())


def test_each_robot_of_each_match_is_drawn_by_itself(in_python: None) -> None:
    batch, drawn = Batch(SHARKS, 60, vary=VARY, threads=1), []
    a = batch.records
    for _ in range(2):
        batch.reset()
        turning = a.robots.motions[..., 1] / a.model.motions[..., 1]
        assert np.array_equal(turning[..., 0], turning[..., 1])
        shares = a.robots.v_max / a.model.v_max, a.robots.slew / a.model.slew, turning[..., 0]
        even = [(share - 1.0) / x for share, x in zip(shares, VARY[:3], strict=True)]  # -1 to 1
        slowest = a.setting.slowest
        even += [2.0 * (a.standing.limits / a.robots.v_max - slowest) / (1.0 - slowest) - 1.0]
        drawn.append(np.hstack([*even, a.minds.loss[:, None] / VARY.loss * 2.0 - 1.0, a.minds.late[:, None]]))
    rows = np.vstack(drawn)
    assert dependence(rows) < 0.5
    assert np.unique(rows[:, :-1]).size == rows[:, :-1].size, "no match and no beginning has the robots of another"
    assert np.abs(rows[:, :-1]).max() <= 1.0
    assert rows[:, :-1].mean(axis=0) == pytest.approx(0.0, abs=0.25)
    assert rows[:, :-1].std(axis=0) == pytest.approx(3**-0.5, abs=0.1)
    assert set(rows[:, -1]) == set(range(VARY.delay + 1))


def test_each_player_measures_its_place_with_noise_of_its_own(in_python: None) -> None:
    batch = Batch(SHARKS, 1, vary=VARY, threads=1)
    batch.reset()
    m, mind, chance = batch.records.motions[0], batch.records.minds[0], batch.records.chance[0]
    true, errors = m.poses.copy(), []
    for _ in range(400):
        stepping.measure(m, mind, chance, VARY)
        stepping.publish(m, mind, False)
        errors.append((mind.own[:, :3] - true).reshape(-1))
    found = np.array(errors)
    assert dependence(found) < 0.25
    assert found.mean(axis=0) == pytest.approx(0.0, abs=0.012)
    expected = [VARY.position_noise, VARY.position_noise, VARY.heading_noise] * len(true)
    assert found.std(axis=0) == pytest.approx(expected, rel=0.15)
    assert np.array_equal(mind.poses, true), "what the referee publishes has no noise"


def test_each_command_is_lost_by_itself_and_the_one_before_it_holds(in_python: None) -> None:
    batch = Batch(SHARKS, 1, vary=VARY, threads=1)
    batch.reset()
    mind, chance = batch.records.minds[0], batch.records.chance[0]
    mind.late, mind.loss = 3, 0.3
    players = len(batch.players)
    lost, newest = [], np.zeros((401, players))
    for step in range(1, 401):
        for n in range(players):
            stepping.keep(mind, chance, n, float(step), -float(step))
        newest[step] = mind.wanted[:, 0, 0]
        assert np.array_equal(mind.wanted[:, 0, 1], -newest[step])
        assert np.array_equal(mind.wanted[:, mind.late, 0], newest[max(0, step - mind.late)])
        lost.append(newest[step] != step)
        assert np.array_equal(newest[step][lost[-1]], newest[step - 1][lost[-1]])
    assert np.mean(lost, axis=0) == pytest.approx(mind.loss, abs=0.1)
    assert dependence(np.array(lost, dtype=float)) < 0.25


def test_a_command_that_is_late_moves_the_robot_so_many_decisions_later(in_python: None) -> None:
    """Also in a match that begins anew, whose robots stand until the first command of it has come."""
    late = Batch(TWO, 8, vary=Variation(delay=VARY.delay), threads=1)
    soon = Batch(TWO, 8, threads=1)
    rng = np.random.default_rng(0)
    for _ in range(2):
        late.reset()
        soon.reset()
        by = late.records.minds.late
        assert len(set(by)) > 3
        actions = np.zeros((VARY.delay + 12, *late.out.observations.shape[:2], 2), dtype=np.float32)
        actions[VARY.delay :] = rng.uniform(-1.0, 1.0, actions[VARY.delay :].shape)
        for step in range(VARY.delay, len(actions)):
            late.step(actions[step])
            soon.step(actions[step - by, np.arange(8)])
            assert np.array_equal(late.records.motions.poses, soon.records.motions.poses)
    assert np.abs(soon.records.motions.velocities).max() > 0.1


def test_a_player_knows_the_top_speed_of_the_match_file_and_not_that_of_its_robot(in_python: None) -> None:
    """As in a match: what a policy sees of its own speed is what the robot measures, by the model's top speed."""
    for setup in (SHARKS, TWO):
        batch = Batch(setup, 2, vary=Variation(speed=0.3), threads=1)
        batch.reset()
        for _ in range(12):
            batch.step(np.ones((2, len(batch.players), 2), dtype=np.float32) * [0.5, 0.1])
        a = batch.records
        assert a.motions.rolled[..., 0].min() > 0.3
        assert batch.out.observations[..., 2] == pytest.approx(a.motions.rolled[..., 0] / a.model.v_max)


def test_a_robot_that_turns_otherwise_than_its_model_turns_no_faster_where_it_is_pushed(in_python: None) -> None:
    batch = Batch(TWO, 4, vary=Variation(turning=VARY.turning), threads=1)
    batch.reset()
    a, fastest = batch.records, 0.0
    for m in a.motions:
        for n, side in enumerate((-1.0, 1.0)):
            motion.put(m, n, side * 0.3, 0.0, 1.57 * (1.0 + side))
    for _ in range(30):
        batch.step(np.ones((4, 2, 2), dtype=np.float32) * [0.5, 0.5])
        fastest = max(fastest, float(np.abs(a.motions.velocities[..., 1]).max()))
    assert 0.1 < fastest < a.model.w_max.max() * (1.0 + VARY.turning)
