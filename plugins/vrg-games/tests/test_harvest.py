"""Harvest: its rules on numbers and beside a slow referee, and whole matches."""

import math
import random
from dataclasses import replace
from pathlib import Path

import pytest
from msgspec import structs

import vrg
from vrg.bus.messages import Call, Thing
from vrg.config.loading import load_match, match_path
from vrg.coordinator.proof import Case
from vrg.coordinator.rulebook import Contestant, Observation, called
from vrg.errors import ConfigError
from vrg.hal.sim.config import BodySetup
from vrg.hal.sim.contact import rectangle
from vrg.runs.judged import judge_folder
from vrg.runs.run_folder import RunFolder
from vrg.testing.matches import calls_of, played, written
from vrg.testing.rulebook import RuleBookContract
from vrg.types import Pose, Vector
from vrg_games.harvest import BLUES, KINDS, REDS
from vrg_games.harvest.proof import prove
from vrg_games.harvest.rules import Harvest, Settings

PIECE = BodySetup(
    name="red-1", kind="red-piece", pose=Pose(1.0, 0.0, 0.0), corners=rectangle(0.3, 0.3).corners, mass=1.0, height=0.3,
    friction=0.4, restitution=0.1,
)  # fmt: skip
BALL = replace(PIECE, name="blue-1", kind="blue-piece", pose=Pose(-1.0, 0.0, 0.0), corners=(), radius=0.2)
STARTS = {"red": Pose(-3.0, 1.0, 0.0), "blue": Pose(3.0, -1.0, math.pi)}


@pytest.fixture
def book() -> Harvest:
    made = Harvest(Settings(), contestants(), 7)
    made.equip([PIECE, BALL])
    return made


def contestants() -> list[Contestant]:
    return [Contestant(name=f"a {r}", role=r, start=at, size=(0.5, 0.49), v_max=0.7) for r, at in STARTS.items()]


def field(things: dict[str, Pose], **at: Vector) -> Observation:
    places = {"red-1": PIECE.pose, "blue-1": BALL.pose} | things
    poses = {f"a {role}": Pose(*at[role], 0.0) if role in at else pose for role, pose in STARTS.items()}
    return Observation(poses, things={name: Thing(name, pose) for name, pose in places.items()})


class TestTheRuleBook(RuleBookContract):
    """The suite that VRG ships. Pieces and trespassers are judged where they are at a look."""

    by_looks = frozenset({"home", "taken", "out", "trespass"})

    @pytest.fixture
    def ready(self, book: Harvest) -> Observation:
        return field({})


@pytest.mark.parametrize(
    ("things", "points", "rules"),
    [
        ({"red-1": Pose(-5.0, 0.0, 0.0)}, {REDS: 2}, ["home"]),
        ({"red-1": Pose(5.0, 0.0, 0.0)}, {BLUES: 1}, ["home"]),
        ({"red-1": Pose(-4.16, 0.0, 0.0)}, {REDS: 2}, ["home"]),
        ({"red-1": Pose(-4.14, 0.0, 0.0)}, {}, []),
        ({"red-1": Pose(-4.16, 0.0, math.pi / 4)}, {}, []),
        ({"blue-1": Pose(4.21, 0.79, 0.0)}, {BLUES: 2}, ["home"]),
        ({"blue-1": Pose(4.21, 0.81, 0.0)}, {}, []),
        ({"red-1": Pose(-5.0, 0.0, 0.0), "blue-1": Pose(-5.0, 0.5, 0.0)}, {REDS: 3}, ["home", "home", "all_home"]),
    ],
)
def test_what_is_wholly_in_a_depot_counts(
    book: Harvest, things: dict[str, Pose], points: dict[str, int], rules: list[str]
) -> None:
    verdict = book.judge(book.initial(), field({}), field(things), 10.0)
    assert [call.rule for call in verdict.calls] == rules
    assert verdict.round_over == ("all_home" in rules)
    assert {team: count for team, count in verdict.state.points.items() if count} == points
    again = book.judge(verdict.state, field(things), field(things), 10.1)
    assert ([call.rule for call in again.calls if call.rule != "all_home"], again.state) == ([], verdict.state)
    left = book.judge(verdict.state, field(things), field({}), 10.2)
    assert [call.rule for call in left.calls] == ["taken"] * rules.count("home")
    assert not any(left.state.points.values())


def test_who_is_in_the_other_depot_gives_points_away_every_few_seconds(book: Harvest) -> None:
    state, called = book.initial(), []
    here = field({}, red=(5.0, 0.0), blue=(5.0, 0.5))
    for look in range(70):
        verdict = book.judge(state, here, here, 0.1 * look)
        state = verdict.state
        called += [(call.players, round(0.1 * look, 1)) for call in verdict.calls]
    assert called == [(("a red",), 0.0), (("a red",), 3.0), (("a red",), 6.0)]
    assert state.points == {BLUES: 3}


def test_a_piece_that_leaves_the_field_is_put_back(book: Harvest) -> None:
    verdict = book.judge(book.initial(), field({}), field({"blue-1": Pose(0.0, 4.1, 0.0)}), 1.0)
    assert ([call.rule for call in verdict.calls], verdict.place) == (["out"], {"blue-1": BALL.pose})


def test_the_alliance_with_more_points_wins_when_the_time_is_up(book: Harvest) -> None:
    state = structs.replace(book.initial(), points={REDS: 3, BLUES: 5})
    verdict = book.judge(state, field({}), field({}), 120.0)
    assert verdict.round_over
    assert book.next_round(verdict.state, field({})).winner == BLUES


def slow_points(rules: Settings, places: dict[str, tuple[BodySetup, Pose]]) -> dict[str, int]:
    """The points of each alliance, by many points on the rim of each piece."""
    found = {REDS: 0, BLUES: 0}
    for piece, pose in places.values():
        rim = []
        for k in range(720):
            angle = math.tau * k / 720
            if piece.radius:
                u, v = piece.radius * math.cos(angle), piece.radius * math.sin(angle)
            else:  # where a ray from the middle meets a square
                far = 0.15 / max(abs(math.cos(angle)), abs(math.sin(angle)))
                u, v = far * math.cos(angle), far * math.sin(angle)
            c, s = math.cos(pose.theta), math.sin(pose.theta)
            rim.append((pose.x + c * u - s * v, pose.y + s * u + c * v))
        for team, side in ((REDS, -1.0), (BLUES, 1.0)):
            low = rules.length / 2 - rules.depot
            if all(low <= side * x <= rules.length / 2 and abs(y) <= rules.depot / 2 for x, y in rim):
                found[team] += 2 if KINDS[piece.kind] == team else 1
    return found


def test_a_slow_referee_counts_the_same_in_300_matches_at_random(book: Harvest) -> None:
    rules, counted = book.settings, 0
    for seed in range(300):
        rng, state, clock = random.Random(seed), book.initial(), 0.0
        before = field({})
        for _ in range(12):
            clock += 1.0
            sides = [(name, rng.choice((-1.0, 1.0)) * rng.uniform(3.9, 5.9)) for name in ("red-1", "blue-1")]
            places = {name: Pose(x, rng.uniform(-1.2, 1.2), rng.uniform(-3.0, 3.0)) for name, x in sides}
            now = field(places)
            verdict = book.judge(state, before, now, clock)
            expected = slow_points(rules, {"red-1": (PIECE, places["red-1"]), "blue-1": (BALL, places["blue-1"])})
            got = {team: verdict.state.points.get(team, 0) for team in (REDS, BLUES)}
            assert got == expected, (seed, places)
            counted += sum(expected.values()) > 0
            state, before = verdict.state, now
    assert counted > 1000


@pytest.mark.parametrize(
    ("rule", "things", "red", "right"),
    [
        ("home", {"red-1": Pose(-5.0, 0.0, 0.0)}, (-3.0, 1.0), True),
        ("home", {"red-1": Pose(-4.05, 0.0, 0.0)}, (-3.0, 1.0), False),
        ("home", {"red-1": Pose(-5.0, 1.05, 0.0)}, (-3.0, 1.0), False),
        ("taken", {"red-1": Pose(-5.0, 1.05, 0.0)}, (-3.0, 1.0), True),
        ("taken", {"red-1": Pose(5.0, 0.5, 0.0)}, (-3.0, 1.0), False),
        ("all_home", {"red-1": Pose(-5.0, 0.0, 0.0), "blue-1": Pose(4.21, 0.0, 0.0)}, (-3.0, 1.0), True),
        ("all_home", {"red-1": Pose(-5.0, 0.0, 0.0), "blue-1": Pose(4.19, 0.0, 0.0)}, (-3.0, 1.0), False),
        ("trespass", {}, (4.1, 0.9), True),
        ("trespass", {}, (4.1, 1.1), False),
        ("trespass", {}, (-5.0, 0.0), False),
    ],
)
def test_the_proof_of_a_wrong_call_is_wrong(
    book: Harvest, rule: str, things: dict[str, Pose], red: Vector, right: bool
) -> None:
    now = field(things, red=red)
    if rule == "trespass":
        call = called(rule, "", {"a red": now.poses["a red"]})
    else:
        call = Call(rule=rule, text="", poses=(now.things["red-1"].pose,))
    measures = prove(book, Case(call, book.initial(), now, now))
    assert measures
    assert all(measure.holds for measure in measures) is right


def test_what_a_match_file_lacks_is_said(tmp_path: Path) -> None:
    text = match_path("harvest").read_text()
    wrong = {
        "none": (text.replace("-piece", "-stone"), "expected bodies of the kinds"),
        "depot": (text.replace("x = -3.2\ny = -1.5", "x = 5.0\ny = 0.0"), "in the other alliance's depot"),
        "alone": (text.replace('role = "blue"', 'role = "red"').replace("x = 3.2", "x = -1.2"), "both alliances"),
        "outside": (text.replace("y = 3.3", "y = 4.4"), "expected a start on the field"),
    }
    for name, (changed, said) in wrong.items():
        file = tmp_path / f"{name}.toml"
        file.write_text(changed)
        with pytest.raises(ConfigError, match=said):
            load_match(file)


@pytest.mark.parametrize(("engine", "seed"), [("planar", 1), ("mujoco", 2)])
def test_a_match_is_played_and_judged_again(tmp_path: Path, engine: str, seed: int) -> None:
    run = vrg.play("harvest", engine=engine, seed=seed, record=False, runs=tmp_path)
    assert [call.rule for call in run.calls].count("home") >= 4
    assert run.winner in (REDS, BLUES, "draw")
    folder = RunFolder(next(tmp_path.iterdir()))
    assert not judge_folder(folder, load_match(folder.match_file)).disagreements


def test_robots_with_grippers_carry_pieces_home_and_a_strict_match_is_the_same(tmp_path: Path) -> None:
    text = match_path("harvest").read_text().replace("\nrole = ", '\nmodel = "Gatherer"\nrole = ')
    journals = []
    for strict in (False, True):
        folder = tmp_path / str(strict)
        folder.mkdir()
        _, run = played(written(folder, text, seed=2), folder / "run", strict=strict)
        journals.append(run.journal.read_bytes())
    assert len(calls_of(run, "home")) >= 8
    assert journals[0] == journals[1]
