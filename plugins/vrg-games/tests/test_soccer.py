"""Soccer: its rules on numbers and beside a slow referee, kicks, and whole matches."""

import math
import random
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

import vrg
from vrg.agents import Action
from vrg.agents.messages import sendable, usable
from vrg.bus.messages import PlayerStatus, RefereeState, Stage, Thing
from vrg.config.loading import load_match, match_path
from vrg.coordinator.proof import Case
from vrg.coordinator.rulebook import Contestant, Observation, called
from vrg.errors import ConfigError
from vrg.hal.models import robot_model
from vrg.hal.sim.config import BodySetup, RobotSetup, WorldConfig
from vrg.hal.sim.world import World
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.runs.judged import judge_folder
from vrg.runs.run_folder import RunFolder
from vrg.testing.rulebook import RuleBookContract
from vrg.types import STILL, Pose, Twist, Vector
from vrg_games.soccer import BLUES, OTHER, REDS
from vrg_games.soccer.proof import prove
from vrg_games.soccer.robot import STRIKER
from vrg_games.soccer.rules import GRACE, Soccer, SoccerState
from vrg_games.soccer.settings import Settings

BALL = BodySetup(
    name="ball", kind="ball", pose=Pose(0.0, 0.0, 0.0), radius=0.0215, mass=0.046, height=0.043, friction=0.03,
    restitution=0.5,
)  # fmt: skip
STARTS = {
    "red-keeper": Pose(-2.8, 0.0, 0.0), "red": Pose(-1.0, 0.9, 0.0),
    "blue-keeper": Pose(2.8, 0.0, math.pi), "blue": Pose(1.0, -0.9, math.pi),
}  # fmt: skip


def contestants() -> list[Contestant]:
    return [Contestant(name=f"a {r}", role=r, start=at, size=(0.16, 0.17), v_max=1.2) for r, at in STARTS.items()]


@pytest.fixture
def book() -> Soccer:
    made = Soccer(Settings(), contestants(), 7)
    made.equip([BALL])
    return made


def field(book: Soccer, x: float, y: float, time: float = 0.0, **at: Vector) -> Observation:
    """The field with the ball at a place; players may be elsewhere than on their marks."""
    poses = dict(book.marks(book.initial()))
    poses |= {f"a {role}": Pose(*place, 0.0) for role, place in at.items()}
    return Observation(poses, time=time, things={"ball": Thing("ball", Pose(x, y, 0.0))})


class TestTheRuleBook(RuleBookContract):
    """The suite that VRG ships. It moves players only, so no ball is ever out."""

    @pytest.fixture
    def ready(self, book: Soccer) -> Observation:
        return field(book, 0.0, 0.0)


@pytest.mark.parametrize(
    ("start", "end", "last", "rule", "kick", "spot"),
    [
        ((2.9, 0.3), (3.1, 0.3), REDS, "goal", BLUES, (0.0, 0.0)),
        ((-2.9, 0.3), (-3.1, 0.3), REDS, "goal", REDS, (0.0, 0.0)),
        ((2.9, 0.3), (3.02, 0.3), REDS, "", "", None),
        ((2.9, 0.6), (3.1, 0.6), REDS, "free_kick", BLUES, (2.6, 1.8)),
        ((2.9, 0.6), (3.1, 0.6), BLUES, "free_kick", REDS, (2.8, 1.8)),
        ((-2.9, -1.5), (-3.1, -1.5), BLUES, "free_kick", REDS, (-2.6, -1.8)),
        ((0.5, 1.9), (0.5, 2.1), BLUES, "free_kick", REDS, (0.5, 1.8)),
        ((0.5, -1.9), (0.5, -2.1), "", "free_kick", BLUES, (0.5, -1.8)),
        ((2.95, 1.9), (3.2, 2.4), REDS, "free_kick", BLUES, (2.8, 1.8)),
    ],
)
def test_where_the_ball_leaves_the_field(
    book: Soccer, start: Vector, end: Vector, last: str, rule: str, kick: str, spot: Vector | None
) -> None:
    state = structs.replace(book.initial(), kick="", last=last)
    verdict = book.judge(state, field(book, *start), field(book, *end, 0.1), 20.0)
    assert [call.rule for call in verdict.calls] == ([rule] if rule else [])
    if rule == "goal":
        assert verdict.round_over
        assert verdict.state.starts == kick
        assert verdict.state.points == {OTHER[kick]: 1}
        assert book.next_round(verdict.state, field(book, 0.0, 0.0)).state.kick == kick
    elif spot is not None:
        assert (verdict.state.kick, verdict.place["ball"]) == (kick, Pose(*spot, 0.0))


def slowly(rules: Settings, radius: float, start: Vector, end: Vector) -> tuple[str, float] | None:
    """What happens on a way, found millimetre by millimetre: over which line the ball went, and where."""
    steps = max(1, math.ceil(1000.0 * math.dist(start, end)))
    for step in range(1, steps + 1):
        x, y = (a + (b - a) * step / steps for a, b in zip(start, end, strict=True))
        if abs(x) - radius > rules.length / 2:
            return ("goal" if abs(y) < rules.goal / 2 else "goal line"), y
        if abs(y) - radius > rules.width / 2:
            return "touch line", x
    return None


def test_a_slow_referee_sees_the_same_in_300_matches_at_random(book: Soccer) -> None:
    rules, seen = book.settings, dict[str, int]()
    for seed in range(300):
        rng = random.Random(seed)
        state, x, y, clock = structs.replace(book.initial(), kick=""), 0.0, 0.0, 10.0
        heading, speed = rng.uniform(-4.0, 4.0), rng.uniform(1.0, 8.0)
        last = rng.choice((REDS, BLUES))
        state = structs.replace(state, last=last)
        for _ in range(60):
            clock += 0.1
            to = x + 0.1 * speed * math.cos(heading), y + 0.1 * speed * math.sin(heading)
            nobody = dict.fromkeys(("red", "blue"), (0.0, -1.4))
            verdict = book.judge(state, field(book, x, y, **nobody), field(book, *to, **nobody), clock)
            expected = slowly(rules, BALL.radius, (x, y), to)
            calls = [call.rule for call in verdict.calls if call.rule in ("goal", "free_kick")]
            if expected is None:
                assert not calls, seed
                if verdict.place:
                    break  # it was put elsewhere for another reason
            else:
                line, where = expected
                near_post = abs(abs(where) - rules.goal / 2) < 0.002 and line != "touch line"
                near_corner = math.dist((abs(to[0]), abs(to[1])), (3.0, 2.0)) < 0.3
                if near_post or near_corner:
                    break
                seen[line] = seen.get(line, 0) + 1
                assert calls == ["goal" if line == "goal" else "free_kick"], seed
                defender = REDS if to[0] < 0.0 else BLUES
                if line == "goal":
                    assert verdict.state.points == {OTHER[defender]: 1}
                else:
                    assert verdict.state.kick == OTHER[last]
                    assert rules.field.contains(verdict.place["ball"].x, verdict.place["ball"].y)
                break
            state, (x, y) = structs.replace(verdict.state, last=last), to
            heading += rng.uniform(-0.3, 0.3)
    assert min(seen.get(line, 0) for line in ("goal", "goal line", "touch line")) > 20


@pytest.mark.parametrize(
    ("ball", "kick", "at", "said"),
    [
        ((2.5, 0.0), "", {"red": (2.4, 0.0)}, "a red attacks in the defence area: a free kick for the blues"),
        ((2.5, 0.0), "", {"blue": (2.6, 0.0)}, "a blue defends in its own defence area and is not the keeper: a free"),
        ((2.5, 0.0), "", {"blue-keeper": (2.6, 0.0)}, ""),
        ((0.5, 1.0), REDS, {"blue": (0.6, 1.0)}, "a blue touches the ball of a kick for the reds: a free kick for the"),
        ((0.5, 1.0), REDS, {"red": (0.4, 1.0)}, ""),
        ((0.5, 1.0), "", {"blue": (0.6, 1.0)}, ""),
    ],
)
def test_fouls(book: Soccer, ball: Vector, kick: str, at: dict[str, Vector], said: str) -> None:
    state = structs.replace(book.initial(), kick=kick, spot=ball, rested=ball)
    now = field(book, *ball, 0.1, **at)
    verdict = book.judge(state, field(book, *ball, **at), now, GRACE + 0.1)
    assert "".join(call.text for call in verdict.calls).startswith(said) == bool(verdict.calls or not said)
    assert bool(verdict.calls) is bool(said)
    assert not book.judge(state, field(book, *ball, **at), now, GRACE / 2).calls or not kick


@pytest.mark.parametrize(
    ("ball", "kick", "at", "right"),
    [
        ((2.5, 0.0), "", (2.4, 0.0), True),
        ((2.1, 0.0), "", (2.0, 0.0), False),
        ((2.5, 0.0), "", (2.3, 0.0), False),
        ((0.5, 1.0), BLUES, (0.4, 1.0), True),
        ((0.5, 1.0), BLUES, (0.2, 1.0), False),
    ],
)
def test_the_proof_of_a_wrong_foul_is_wrong(book: Soccer, ball: Vector, kick: str, at: Vector, right: bool) -> None:
    now = field(book, *ball, red=at)
    call = called("foul", "", {"a red": now.poses["a red"]})
    measures = prove(book, Case(call, structs.replace(book.initial(), kick=kick), now, now))
    assert measures
    assert all(measure.holds for measure in measures) is right


def test_a_kick_that_is_disturbed_again_and_again_is_given_up(book: Soccer) -> None:
    state, called = structs.replace(book.initial(), kick=REDS, spot=(0.5, 1.0), rested=(0.5, 1.0)), []
    here = field(book, 0.5, 1.0, blue=(0.6, 1.0))
    for look in range(120):
        verdict = book.judge(state, here, here, 0.1 * look)
        state = verdict.state
        called += [(call.rule, verdict.place["ball"]) for call in verdict.calls]
        if state.kick != REDS:
            break
    assert called == [("foul", Pose(0.5, 1.0, 0.0))] * 3 + [("no_progress", Pose(0.0, 0.0, 0.0))]
    assert (state.kick, dict(state.numbers), state.fouls) == ("", {}, 0)


def test_a_kick_waits_for_the_ball_and_cannot_be_stolen(book: Soccer) -> None:
    """Over processes the world puts the ball a look later than it is asked to."""
    state = structs.replace(book.initial(), kick="", last=REDS)
    out = book.judge(state, field(book, 1.0, 1.95), field(book, 1.0, 2.1), 10.0)
    assert out.state.kick == BLUES
    waited = book.judge(out.state, field(book, 1.0, 2.1), field(book, 1.0, 2.2), 10.1)
    assert (list(waited.calls), waited.state) == ([], out.state)
    there = book.judge(waited.state, field(book, 1.0, 2.2), field(book, 1.0, 1.8), 10.2)
    assert (there.state.kick, there.state.placing) == (BLUES, False)
    stolen = field(book, 1.3, 1.8, red=(1.2, 1.8))
    verdict = book.judge(there.state, field(book, 1.0, 1.8), stolen, 10.3)
    assert [call.rule for call in verdict.calls] == ["foul"]
    assert verdict.place == {"ball": Pose(1.0, 1.8, 0.0)}
    own = book.judge(there.state, field(book, 1.0, 1.8), field(book, 1.3, 1.8, blue=(1.2, 1.8)), 10.3)
    assert (list(own.calls), own.state.kick, own.state.last) == ([], "", BLUES)


def test_a_ball_that_rolls_out_during_a_halt_is_out(book: Soccer) -> None:
    state = structs.replace(book.initial(), kick="", last=REDS)
    here = field(book, 3.4, 0.1)
    verdict = book.judge(state, here, here, 10.0)
    assert [call.rule for call in verdict.calls] == ["free_kick"], "it has not been seen to pass between the posts"
    assert verdict.state.kick == BLUES


def test_who_pushes_near_the_ball_gives_a_free_kick_away(book: Soccer) -> None:
    state = structs.replace(book.initial(), kick="")
    here = {"red": (0.5, 0.0), "blue": (0.67, 0.0)}
    for ball, fouls in (((0.8, 0.5), 1), ((-1.5, -1.5), 0)):
        now = replace(field(book, *ball, **here), pushed=frozenset({"a red"}))
        calls = book.judge(state, now, now, 5.0).calls
        assert [call.players for call in calls] == [("a red", "a blue")] * fouls


def test_a_ball_without_progress_is_put_elsewhere_and_the_time_ends_the_match(book: Soccer) -> None:
    stuck = structs.replace(book.initial(), kick="", since=1.0, rested=(0.1, 1.9))
    here = field(book, 0.2, 1.9)
    assert not book.judge(stuck, here, here, 8.9).calls
    verdict = book.judge(stuck, here, here, 9.1)
    assert [call.rule for call in verdict.calls] == ["no_progress"]
    assert verdict.place == {"ball": Pose(0.0, 0.0, 0.0)}
    over = book.judge(structs.replace(stuck, played=100.0, points={BLUES: 1}), here, here, 20.0)
    assert "time_up" in [call.rule for call in over.calls]
    assert book.next_round(over.state, here).winner == BLUES


def test_what_a_match_file_lacks_is_said(tmp_path: Path) -> None:
    text = match_path("soccer").read_text()
    wrong = {
        "no ball": (text.replace('kind = "ball"', 'kind = "egg"'), "expected one round body of the kind"),
        "keeper": (text.replace('role = "blue-keeper"', 'role = "blue"'), "of whom one is the blue-keeper"),
        "half": (text.replace("x = -1.0", "x = 1.5", 1), "starts outside its own half"),
        "form": (text.replace("radius = 0.0215", "size = [0.1, 0.1]\nradius = 0.0215"), "one of radius, size and corn"),
        "convex": (text.replace("radius = 0.0215", "corners = [[0, 0], [1, 0]]"), "corners"),
        "goal": (text.replace("goal = 1.2", "goal = 3.0"), "expected goal <= area_width"),
    }
    for name, (changed, said) in wrong.items():
        file = tmp_path / f"{name}.toml"
        file.write_text(changed)
        with pytest.raises(ConfigError, match=said):
            load_match(file)


# Kicks.


def kicked(
    at: Pose, use: dict[str, float], seconds: float = 0.1, *, may_move: bool = True, lease: Twist | None = None
) -> World:
    """A world in which a Striker at the origin uses its kicker again and again, with the ball at a place."""
    config = WorldConfig(
        map="open", noise=False, bodies=(replace(BALL, pose=at, friction=0.0),),
        robots=(RobotSetup(name="r", model="Striker", pose=Pose(0.0, 0.0, 0.0)),),
    )  # fmt: skip
    made = World(config)
    status = PlayerStatus(name="r", team="t", role="r", state="active", may_move=may_move, radius=0.1, lease=lease)
    state = RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=(status,), zones=(),
    )  # fmt: skip
    for _ in range(round(seconds / 0.02)):
        made.referee(state, made.time)
        made.drive("r", STILL, armed=True, use=use)
        made.step()
    return made


@pytest.mark.parametrize(
    ("at", "use", "may_move", "speed"),
    [
        (Pose(0.11, 0.0, 0.0), {"kicker": 4.0}, True, 4.0),
        (Pose(0.11, 0.05, 0.0), {"kicker": 4.0}, True, 4.0),
        (Pose(0.11, 0.0, 0.0), {"kicker": 40.0}, True, 6.0),
        (Pose(0.11, 0.0, 0.0), {"kicker": 4.0}, False, 0.0),
        (Pose(0.11, 0.0, 0.0), {"horn": 4.0}, True, 0.0),
        (Pose(0.16, 0.0, 0.0), {"kicker": 4.0}, True, 0.0),
        (Pose(0.11, 0.08, 0.0), {"kicker": 4.0}, True, 0.0),
        (Pose(-0.11, 0.0, 0.0), {"kicker": 4.0}, True, 0.0),
    ],
)
def test_a_kicker_kicks_what_is_in_front_of_it(at: Pose, use: dict[str, float], may_move: bool, speed: float) -> None:
    ((_, ball),) = kicked(at, use, may_move=may_move).bodies
    assert (ball.vx, ball.vy) == pytest.approx((speed, 0.0))


def test_a_kick_of_nothing_does_nothing_and_a_weak_one_slows_nothing() -> None:
    for use in (0.0, -1.0):
        ((_, ball),) = kicked(Pose(0.11, 0.0, 0.0), {"kicker": use}).bodies
        assert not ball.moves
    made = kicked(Pose(0.5, 0.0, 0.0), {})
    ((_, ball),) = made.bodies
    ball.put(0.11, 0.0, 0.0)
    ball.vx = 2.0
    made.drive("r", STILL, armed=True, use={"kicker": 1.0})
    made.step()
    assert ball.vx == 2.0


def test_a_robot_that_the_referee_drives_does_not_kick() -> None:
    ((_, ball),) = kicked(Pose(0.11, 0.0, 0.0), {"kicker": 4.0}, lease=Twist(0.0, 0.1)).bodies
    assert not ball.moves


def test_a_kicker_needs_a_pause() -> None:
    made = kicked(Pose(0.11, 0.0, 0.0), {"kicker": 1.0})
    ((_, ball),) = made.bodies
    made.bodies.place("ball", Pose(0.11, 0.0, 0.0))
    made.drive("r", STILL, armed=True, use={"kicker": 1.0})
    made.step()
    assert not ball.moves


def test_what_cannot_be_used_is_said() -> None:
    striker, pioneer = robot_model("Striker"), robot_model("P2AT")
    assert usable({"kicker": 99.0}, striker) == {"kicker": STRIKER.actuators[0].most}
    assert usable({"kicker": 1.23456789}) == {"kicker": 1.234568}
    with pytest.raises(ValueError, match=r"expected an actuator of P2AT \(none\), got 'kicker'"):
        usable({"kicker": 1.0}, pioneer)
    with pytest.raises(ValueError, match="expected a finite number for kicker, got nan"):
        usable({"kicker": math.nan}, striker)
    for use in ({"kicker": 10**400}, {"kicker": "hard"}, np.array([1, 2])):
        payload, problems = sendable(Action(STILL, use=use))  # type: ignore[arg-type]
        assert payload.use == {}
        assert problems[0].startswith("use left out: ")


# Whole matches.


@pytest.mark.parametrize(("engine", "seed"), [("planar", 1), ("planar", 2), ("mujoco", 1)])
def test_a_match_is_played_and_judged_again(tmp_path: Path, engine: str, seed: int) -> None:
    run = vrg.play("soccer", engine=engine, seed=seed, record=False, runs=tmp_path)
    rules = {call.rule for call in run.calls}
    assert {"begin", "time_up", "game_over", "free_kick"} <= rules
    assert run.winner in (REDS, BLUES, "draw")
    folder = RunFolder(next(tmp_path.iterdir()))
    judged = judge_folder(folder, load_match(folder.match_file))
    assert not judged.disagreements


def test_over_the_codec_and_over_processes_it_is_the_same_match(tmp_path: Path) -> None:
    journals = []
    for name, strict in (("plain", False), ("strict", True)):
        folder = RunFolder(tmp_path / name)
        folder.prepare()
        setup = load_match(match_path("soccer"), seed=5)
        with open_journal(setup, folder) as journal:
            in_process.play(setup, journal, pace=lambda now: now < 25.0, strict=strict)
        journals.append(folder.journal.read_bytes())
    assert journals[0] == journals[1]
    assert b'"rule":"free_kick"' in journals[0] or b'"rule":"goal"' in journals[0]


def test_by_lockstep_kicks_come_over_the_pipes(tmp_path: Path) -> None:
    text = match_path("soccer").read_text().replace("time = 120.0", "time = 12.0")
    (tmp_path / "short.toml").write_text(text)
    found = []
    for way in ("in-process", "lockstep"):
        command = [str(Path(sys.executable).with_name("vrg")), "play", "short.toml", f"--{way}", "--runs", way]
        more = ["--headless", "--no-record", "--seed", "3"]
        done = subprocess.run([*command, *more], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        (run,) = (tmp_path / way).iterdir()
        found.append((run / "journal.jsonl").read_text().splitlines()[1:])
    assert found[0] == found[1]


def test_players_of_a_state(book: Soccer) -> None:
    state: SoccerState = structs.replace(book.initial(), starts=BLUES)
    marks = book.marks(state)
    takers: Sequence[str] = [name for name, mark in marks.items() if math.hypot(mark.x, mark.y) < 0.5]
    assert takers == ["a blue"]
    assert marks["a blue"] == Pose(0.3, 0.0, math.pi)
