"""The checks of batches are not blind: mistakes that are planted into a batch, one at a time, are found by them."""

import inspect
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import pytest

from batch import test_roboflag, test_twin
from batch import test_sharks_and_minnows as sharks
from batch import test_variation as varied
from batch.test_any_game import as_in_a_batch, assert_the_same
from batch.test_motion import test_robots_in_a_crowd_move_as_in_the_planar_engine as crowd
from vrg_learn.batch import assigning, matches, motion, observing, refereed, roboflag, sharks_and_minnows, stepping


class Planted(NamedTuple):
    """A mistake.

    Args:
        function: where. old: what stands in it, once. new: what stands there in place of it.
    """

    function: Any
    old: str
    new: str


@contextmanager
def planted(mistake: Planted) -> Iterator[None]:
    """Let a function make a mistake, wherever it is called.

    Raises:
        ValueError: what is to be replaced does not stand there once.
    """
    function, old, new = mistake
    source, names = inspect.getsource(function), dict(vars(sys.modules[function.__module__]))
    if source.count(old) != 1:
        raise ValueError(f"{function.__qualname__}: expected once, found {source.count(old)} times: {old}")
    exec(compile(source.replace(old, new), function.__code__.co_filename, "exec"), names)
    right, function.__code__ = function.__code__, names[function.__name__].__code__
    try:
        yield
    finally:
        function.__code__ = right


SHARKS = (
    Planted(sharks_and_minnows.next_round, "t.roles[n], t.active[n] = SHARK, True", "t.active[n] = True"),
    Planted(sharks_and_minnows.judge, "c.others[:] = False", "pass"),
    Planted(sharks_and_minnows.judge, "t.before[:] = m.poses", "pass"),
    Planted(assigning.line_up, "dx * dx + dy * dy", "np.sqrt(dx * dx + dy * dy)"),
)
OUT = (Planted(sharks_and_minnows.judge, "t.clock += dt", "t.clock += 2.0 * dt"),)
FLAGS = (
    Planted(roboflag.judge, "t.number, t.clock)", "t.number, t.clock - dt)"),
    Planted(roboflag.begin_round, "t.carriers[:] = NO_ONE", "pass"),
)
ANYWHERE = (
    Planted(roboflag.judge, "t.before[:] = m.poses", "pass"),
    Planted(roboflag.judge, "c.others[:] = False", "pass"),
    Planted(roboflag.next_round, "if t.number == SUDDEN_DEATH:", "if False:"),
)
SHARKS_ANYWHERE = (Planted(sharks_and_minnows.next_round, "if t.roles[n] == MINNOW:", "if True:"),)
ZONES = (Planted(roboflag.numbers, " or in_zone(s, 1, x, y)", ""),)
MOTION = (
    Planted(motion.walls_of, "b.width)", "b.width + 0.04)"),
    Planted(motion.walls_of, "c.radius)", "c.radius + 0.02)"),
    Planted(motion.gather, "r.brake[n] if m.braking[n] else r.slew[n]", "r.slew[n]"),
    Planted(motion.scatter, "if not slid:", "if True:"),
    Planted(motion.command, "scale = 1.0 if fastest <= limit * LIMIT_ROUNDING else limit / fastest", "scale = 1.0"),
)
LONG = (
    Planted(motion.advance, "at_walls[:walled]", "at_walls[:0]"),
    Planted(motion.advance, "pairs[:paired]", "pairs[:0]"),
)
NODES = (
    Planted(stepping.publish, "k.poses[n, axis] = m.poses", "k.poses[n, axis] = m.before"),
    Planted(observing.observe, "2.0 * model.v_max", "1.0 * model.v_max"),
    Planted(sharks_and_minnows.drive, "t.limits[n]", "r.v_max[n]"),
)
NOISE = (
    Planted(stepping.measure, "k.own[n, 0] += vary", "k.own[n, 0] += k.own[0, 0] - m.poses[0, 0] if n else vary"),
    Planted(stepping.measure, "vary.heading_noise * normal", "vary.position_noise * normal"),
)
DRAWN = (
    Planted(stepping.draw, "between(chance, 0.0, vary.delay + 1.0)", "between(chance, 0.0, vary.delay)"),
    Planted(stepping.draw, "r.slew[n] = ", "r.slew[n] = r.slew[0] if n else "),
    Planted(sharks_and_minnows.reset, "t.limits[n] = ", "t.limits[n] = t.limits[0] if n else "),
)
LOST = (
    Planted(stepping.keep, "uniform(chance) >= k.loss", "uniform(chance) < k.loss"),
    Planted(stepping.keep, "range(k.late, 0, -1)", "range(1, k.late + 1)"),
)
LATE = (
    Planted(stepping.steer, "k.wanted[n, k.late, 0]", "k.wanted[n, 0, 0]"),
    Planted(stepping.draw, "k.wanted[:] = 0.0", "pass"),
)
REFEREED = (
    Planted(refereed.drive, "elif t.led[n] and not stands:", "elif False:"),
    Planted(refereed.drive, "elif t.was_led[n]:", "elif t.led[n]:"),
    Planted(refereed.coast, "lock(a.motions[b], n)", "pass"),
)
SLOW = (SHARKS, LONG, ANYWHERE, SHARKS_ANYWHERE, ZONES, REFEREED)
"""Those whose tests take long."""


def check_referees() -> None:
    """A match of RoboFlag under its referee, in which players are led home, and a round ends."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(matches, "GAMES", {})
        assert_the_same(as_in_a_batch(test_roboflag.SMALL), lambda _, seen, rng: test_roboflag.drives(seen, rng), 1)


TABLE: tuple[tuple[Callable[[], None], tuple[Planted, ...]], ...] = (
    (partial(sharks.test_the_calls_of_a_small_match_are_those_of_the_referee, None), SHARKS),
    (partial(sharks.test_the_calls_are_those_of_the_referee_where_a_shark_and_a_minnow_leave_the_field, None), OUT),
    (partial(test_roboflag.test_the_calls_of_a_small_match_are_those_of_the_referee, None), FLAGS),
    (partial(test_roboflag.test_the_calls_are_those_of_the_referee_wherever_players_are, None), ANYWHERE),
    (partial(sharks.test_the_calls_are_those_of_the_referee_wherever_players_are, None), SHARKS_ANYWHERE),
    (partial(test_twin.test_the_same_actions_are_the_same_match, test_roboflag, True, True), ZONES),
    (partial(crowd, 4, True), MOTION),
    (partial(crowd, 4, False), LONG),
    (partial(test_twin.test_the_same_actions_are_the_same_match, sharks, False, True), NODES),
    (partial(varied.test_each_player_measures_its_place_with_noise_of_its_own, None), NOISE),
    (partial(varied.test_each_robot_of_each_match_is_drawn_by_itself, None), DRAWN),
    (partial(varied.test_each_command_is_lost_by_itself_and_the_one_before_it_holds, None), LOST),
    (partial(varied.test_a_command_that_is_late_moves_the_robot_so_many_decisions_later, None), LATE),
    (check_referees, REFEREED),
)
"""Tests, as they are in Python, and the mistakes that each finds: the first also in `make test`, if it is not SLOW."""


@pytest.mark.parametrize(
    ("check", "mistake"),
    [
        pytest.param(
            check,
            mistake,
            marks=[pytest.mark.thorough] if number or mistakes in SLOW else [],
        )
        for check, mistakes in TABLE
        for number, mistake in enumerate(mistakes)
    ],
)
def test_a_mistake_is_found(check: Callable[[], None], mistake: Planted, in_python: None) -> None:
    with planted(mistake), pytest.raises(AssertionError):
        check()
