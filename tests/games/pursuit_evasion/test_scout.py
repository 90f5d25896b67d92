"""The scout of pursuit-evasion: what counts of what it sees, and whole matches with it."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from vrg.bus.messages import Sighting
from vrg.config.loading import load_match, match_path
from vrg.coordinator.rulebook import Contestant, Observation
from vrg.errors import ConfigError
from vrg.games.pursuit_evasion import INTRUDER, PURSUER, PURSUERS, SCOUT, SCOUTING
from vrg.games.pursuit_evasion.rules import PursuitEvasion
from vrg.games.pursuit_evasion.seeing import MOVED, can_see
from vrg.games.pursuit_evasion.settings import Settings
from vrg.hal.sensors.downward import OverviewSpec
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.runs.judged import judge_folder
from vrg.runs.run_folder import RunFolder
from vrg.types import Pose

MATCH = "pursuit-evasion-scouted"
SETTINGS = Settings.model_validate({"area": [[0, 0], [20, 0], [20, 20], [0, 20]], "launch_window": 0.0})
CAMERA = OverviewSpec()


def player(name: str, role: str, x: float, y: float, overview: OverviewSpec | None = None) -> Contestant:
    return Contestant(name=name, role=role, start=Pose(x, y, 0.0), size=(0.5, 0.4), v_max=0.7, overview=overview)


def book(overview: OverviewSpec | None = CAMERA) -> PursuitEvasion:
    return PursuitEvasion(
        SETTINGS,
        [player("p", PURSUER, 18.0, 2.0), player("s", SCOUT, 10.0, 10.0, overview), player("i", INTRUDER, -2.0, 10.0)],
    )


def test_a_scout_is_of_the_pursuers_and_needs_a_camera_that_looks_down() -> None:
    made = book()
    assert (made.team_of("s"), made.initial().states["s"]) == (PURSUERS, SCOUTING)
    assert made.speed_limits()["p"] == 0.7
    with pytest.raises(ConfigError, match="a scout needs a robot whose camera looks down: write model"):
        book(None)


@given(st.floats(0.1, 2.5), st.floats(0.0, 12.0), st.floats(-3.0, 3.0))
def test_it_can_see_what_is_in_the_cone_below_it(height: float, away: float, bearing: float) -> None:
    poses = {"s": Pose(10.0, 10.0, 0.0, height)}
    poses["i"] = Pose(10.0 + away * math.cos(bearing), 10.0 + away * math.sin(bearing), 0.0)
    contestants = book().contestants
    reach = height * math.tan(CAMERA.fov / 2) + MOVED
    if abs(away - reach) > 1e-6:
        assert can_see("s", "i", poses, contestants, ()) is (away < reach)
    grounded = {**poses, "s": Pose(10.0, 10.0, 0.0)}
    assert can_see("s", "i", grounded, contestants, ()) is (away <= MOVED)


def test_two_of_its_sightings_open_an_auction_and_it_neither_captures_nor_is_met() -> None:
    made = book()
    state, clock = made.initial(), 0.0
    before = Observation(
        {"p": Pose(18.0, 2.0, 0.0), "s": Pose(3.0, 10.0, 0.0, 2.5), "i": Pose(-2.0, 10.0, 0.0)}, time=0.0
    )
    rules = []
    for look in range(1, 60):
        clock = 0.1 * look
        x = -2.0 + 0.7 * clock
        sightings = ()
        if look in (20, 25):
            sightings = (("s", Sighting(x=x, y=10.1, time=clock, xx=0.01, xy=0.0, yy=0.01)),)
        now = Observation(
            {"p": Pose(18.0, 2.0, 0.0), "s": Pose(x, 10.0, 0.0, 2.5), "i": Pose(x, 10.0, 0.0)}, time=clock,
            sightings=sightings,
        )  # fmt: skip
        verdict = made.judge(state, before, now, clock)
        rules += [call.rule for call in verdict.calls]
        state, before = verdict.state, now
    assert rules == ["launch", "auction", "enter"], "the scout was above the intruder all the time"


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_a_match_with_a_scout_is_judged_again_without_a_disagreement(tmp_path: Path, engine: str) -> None:
    setup = structs.replace(load_match(match_path(MATCH)), engine=engine, seed=3)
    folder = RunFolder(tmp_path)
    seen: list[float] = []
    with open_journal(setup, folder) as journal:
        in_process.play(setup, journal, pace=lambda now: bool(seen.append(now)) or now < 40.0)
    assert seen[-1] >= 40.0
    judged = judge_folder(folder, setup)
    assert not judged.disagreements
