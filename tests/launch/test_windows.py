"""The windows of a match as their own processes make them."""

import os
from pathlib import Path

import pytest

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState
from vrg.bus.stopping import Stop
from vrg.config.loading import load_match, match_path
from vrg.config.setup import MatchSetup, unknown_match
from vrg.errors import LaunchError
from vrg.launch.context import NodeContext
from vrg.launch.nodes import windows
from vrg.launch.process import Process
from vrg.runs.run_folder import RunFolder
from vrg.testing.views import synthetic
from vrg.ui.commander.node import Commander

os.environ["SDL_VIDEODRIVER"] = os.environ["SDL_AUDIODRIVER"] = "dummy"

KNOWN = load_match(match_path("sharks-and-minnows"))
MINNOWS = [player.name for player in KNOWN.players if player.team == "minnows"]


class Referee:
    """A session in which the referee speaks at the second look; then nobody asks any more."""

    def __init__(self, state: RefereeState | None = None) -> None:
        self.looks, self._state, self._mailbox = 0, state, Mailbox()

    def attach(self, mailbox: Mailbox) -> None:
        self._mailbox = mailbox

    def receive(self) -> None:
        self.looks += 1
        if self._state is not None and self.looks > 1:
            for inlet in self._mailbox.inlets:
                inlet.offer(Received(inlet.topic.key, 0.0, self.looks, self._state))


def made(setup: MatchSetup, team: str, run: Path, session: Referee, *, official: bool = True) -> Commander:
    stop = Stop()
    if session._state is None:
        stop.set()
    context = NodeContext(
        process=Process(name=team, kind="commander", node=team, router="tcp/127.0.0.1:1", run=str(run)),
        setup=setup, folder=RunFolder(run),
        session=session,  # type: ignore[arg-type]
        stop=stop, official=official, own=False, secret="",
    )  # fmt: skip
    node = windows.commander(context).node
    assert isinstance(node, Commander)
    return node


def keys(commander: Commander) -> set[str]:
    """What it hears."""
    return {inlet.topic.key for inlet in commander.mailbox.inlets}


def test_a_commander_with_a_seat_hears_only_of_its_own_team(tmp_path: Path) -> None:
    session = Referee()
    everything = keys(made(KNOWN, "minnows", tmp_path, session))
    assert KNOWN.keys.poses.key in everything
    own = keys(made(KNOWN, "minnows", tmp_path, session, official=False))
    assert KNOWN.keys.poses.key not in own
    assert {KNOWN.keys.report(name).key for name in MINNOWS} <= own
    assert session.looks == 0, "the set-up has the teams"


def test_of_a_match_elsewhere_the_referee_tells_the_teams(tmp_path: Path) -> None:
    state = synthetic.state(1.0)
    session, far = Referee(state), unknown_match("far")
    own = keys(made(far, "minnows", tmp_path, session, official=False))
    assert {far.keys.report(p.name).key for p in state.players if p.team == "minnows"} <= own
    assert far.keys.report("anchor").key not in own
    assert session.looks == 2


@pytest.mark.parametrize("setup", [KNOWN, unknown_match("far")])
def test_a_team_that_does_not_play_has_no_commander(setup: MatchSetup, tmp_path: Path) -> None:
    with pytest.raises(LaunchError, match=r"TEAM: expected one of .*, got 'minows', did you mean 'minnows'"):
        made(setup, "minows", tmp_path, Referee(synthetic.state(1.0)))


def test_a_wait_for_the_referee_can_be_interrupted(tmp_path: Path) -> None:
    assert made(unknown_match("far"), "red", tmp_path, Referee()).name == "red"
