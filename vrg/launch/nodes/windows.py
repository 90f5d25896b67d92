"""The windows of a match: each shows it on this machine until its user closes it."""

from functools import partial
from pathlib import Path

from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError
from vrg.launch.context import Made, NodeContext
from vrg.launch.first_state import first_state
from vrg.launch.running import gone
from vrg.registry import expected_one_of
from vrg.runs.explaining import explain
from vrg.runs.run_folder import RunFolder
from vrg.ui.window.spectator import Spectator
from vrg.ui.window.window_node import WindowNode


def spectator_node(setup: MatchSetup, name: str, run: Path | None, *, official: bool = True) -> Spectator:
    """Make a window that shows a match, with the map's walls and the robots' real sizes.

    Args:
        name: the name of the node.
        run: the run folder, for pictures that its user takes and to explain calls; None if it is not on this machine.
        official: False if its user may only watch and stop everything.
    """
    return Spectator(
        name, Mailbox(), setup.keys, sizes=sizes(setup), obstacles=setup.obstacles, run=run, official=official,
        explain=None if run is None else partial(explain, run),
        again=(lambda: None) if run is None else RunFolder(run).again_if_recorded,
    )  # fmt: skip


def spectator(on: NodeContext) -> Made:
    """The window of the match, or one more."""
    return until_closed(on, spectator_node(on.setup, on.name or on.named("window"), on.run, official=on.official))


def commander(on: NodeContext) -> Made:
    """The window of a team's commander. With a seat, as in every match that has seats, it hears only of its own team.

    Raises:
        LaunchError: there is no such team.
    """
    from vrg.ui.commander.node import Commander  # noqa: PLC0415 - a process opens one window

    setup, team = on.setup, on.name
    match = setup if setup.players else first_state(on.join(), setup.keys, on.stop)
    players = () if match is None else match.players
    teams = list(dict.fromkeys(player.team for player in players))
    if players and team not in teams:
        raise LaunchError(f"TEAM: {expected_one_of(teams, team)}")
    own = [player.name for player in players if player.team == team]
    return until_closed(on, Commander(
        team, Mailbox(), setup.keys, sizes=sizes(setup), obstacles=setup.obstacles, run=on.run,
        seated=None if on.official else own,  # without seats everybody is an official
    ))  # fmt: skip


def until_closed(on: NodeContext, window: WindowNode) -> Made:
    """A window with what `process_main.run_window` is given: beside a match it stays as the match was left."""
    return Made(window, {"ended": None if on.own else gone(on.setup.name, on.process.router)})


def sizes(setup: MatchSetup) -> dict[str, tuple[float, float]]:
    """The length and width of each player's robot, m."""
    return {player.name: player.robot.size for player in setup.players}
