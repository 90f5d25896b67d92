"""The scouts of RoboFlag: of which rules they are no part, whom their team sees by them, and a whole match."""

from pathlib import Path

import pytest
from msgspec import structs

from vrg.config.loading import load_match, match_path
from vrg.coordinator.rulebook import Contestant, Observation
from vrg.errors import ConfigError
from vrg.games.roboflag import BLUES, NORMAL, RED, SCOUTING, SCOUTS, TAGGED
from vrg.games.roboflag.rules import RoboFlag
from vrg.games.roboflag.settings import Settings
from vrg.hal.sensors.downward import OverviewSpec
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.runs.judged import judge_folder
from vrg.runs.run_folder import RunFolder
from vrg.types import Pose

MATCH = "roboflag-scouted"
CAMERA = OverviewSpec()


def player(name: str, role: str, x: float, overview: OverviewSpec | None = None) -> Contestant:
    team = RED if role in (RED, SCOUTS[RED]) else BLUES
    return Contestant(
        name=name, role=role, start=Pose(x, 0.0, 0.0), size=(0.5, 0.4), v_max=0.7, overview=overview, team=team
    )


def book(*more: Contestant) -> RoboFlag:
    players = [player("r", RED, -3.0), player("b", BLUES, 3.0), player("s", SCOUTS[RED], -2.0, CAMERA), *more]
    return RoboFlag(Settings(), players)


def test_a_scout_is_of_its_team_and_starts_in_its_half_in_the_air() -> None:
    made = book()
    assert (made.team_of("s"), made.teams["s"], made.initial().states["s"]) == (RED, RED, SCOUTING)
    assert made.states_of("s") == (SCOUTING,)
    with pytest.raises(ConfigError, match="a scout needs a robot whose camera looks down: write model"):
        book(player("t", SCOUTS[BLUES], 2.0))
    with pytest.raises(
        ConfigError, match="a robot in the air can only be a red-scout or a blue-scout: give it that role"
    ):
        book(player("t", BLUES, 2.0, CAMERA))
    with pytest.raises(ConfigError, match="expected the start of t in the half of its team blue"):
        book(player("t", SCOUTS[BLUES], -2.0, CAMERA))


def test_it_neither_tags_nor_is_tagged_and_takes_no_flag_but_its_team_mates_do() -> None:
    made = book()
    state = made.initial()
    assert dict(made.marks(state)).keys() == {"r", "b", "s"}
    flag = made.layout.flag(BLUES)
    places = {"s": Pose(*flag, 0.0, 2.0), "b": Pose(flag[0] - 2.0, flag[1], 0.0), "r": Pose(-3.0, 0.0, 0.0)}
    for number, over in enumerate(("flag", "b", "b")):
        # The scout is above the opponents' flag, and then above an opponent, on whose half it would be tagged.
        at = places["s"] if over == "flag" else Pose(places["b"].x, places["b"].y, 0.0, 2.0)
        look = Observation({**places, "s": at}, time=0.1 * number)
        verdict = made.judge(state, look, look, 0.1 * number)
        assert not verdict.calls
        state = verdict.state
    assert all("s" not in auction.bidders for auction in state.auctions.values())
    # A player of the same team at the same place is tagged there.
    look = Observation({**places, "r": Pose(places["b"].x, places["b"].y - 0.5, 0.0)}, time=0.4)
    verdict = made.judge(state, look, look, 0.4)
    assert [call.rule for call in verdict.calls] == ["tag"]
    assert (verdict.state.states["r"], verdict.state.states["s"]) == (TAGGED, SCOUTING)


def test_a_scout_keeps_its_mark_in_the_next_round() -> None:
    made = book(player("r2", RED, -1.0))
    swapped = Observation({"r": Pose(-1.0, 0.0, 0.0), "r2": Pose(-3.0, 0.0, 0.0), "s": Pose(2.0, 1.0, 0.0, 2.0)})
    marks = made.next_round(made.initial(), swapped).state.marks
    assert (marks["r"].x, marks["r2"].x, marks["s"].x) == (-1.0, -3.0, -2.0)


@pytest.mark.parametrize("engine", ["planar", "mujoco"])
def test_a_match_with_scouts_is_judged_again_without_a_disagreement(tmp_path: Path, engine: str) -> None:
    setup = structs.replace(load_match(match_path(MATCH)), engine=engine, seed=3)
    strategies = {player.name: player.strategy for player in setup.players}
    assert strategies["red-scout"].endswith(":Scout"), "a team's strategy is for its players on the ground"
    assert strategies["red1"] == "balanced"
    folder = RunFolder(tmp_path)
    seen: list[float] = []
    with open_journal(setup, folder) as journal:
        in_process.play(setup, journal, pace=lambda now: bool(seen.append(now)) or now < 40.0)
    assert seen[-1] >= 40.0
    assert not judge_folder(folder, setup).disagreements


def test_everybody_else_is_normal() -> None:
    assert {name: state for name, state in book().initial().states.items() if name != "s"} == {"r": NORMAL, "b": NORMAL}
