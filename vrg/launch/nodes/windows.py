"""The windows of a match: each shows it on this machine until its user closes it."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup
from vrg.geometry import circumradius
from vrg.hal.sim.map import load_map
from vrg.launch.context import Made, NodeContext
from vrg.launch.running import gone
from vrg.runs.explaining import explain
from vrg.runs.run_folder import RunFolder
from vrg.ui.spectator import Spectator
from vrg.ui.window_node import WindowNode

if TYPE_CHECKING:
    from vrg.ui.hud.node import Hud


def spectator_node(setup: MatchSetup, name: str, run: Path | None, *, official: bool = True) -> Spectator:
    """Make a window that shows a match, with the map's walls and the robots' real sizes.

    Args:
        name: the name of the node.
        run: the run folder, for pictures that its user takes and to explain calls; None if it is not on this machine.
        official: False if its user may only watch and stop everything.
    """
    return Spectator(
        name,
        Mailbox(),
        setup.keys,
        sizes={p.name: p.robot.size for p in setup.players},
        obstacles=setup.obstacles,
        run=run,
        explain=None if run is None else partial(explain, run),
        again=(lambda: None) if run is None else RunFolder(run).again_if_recorded,
        official=official,
    )


def hud_node(setup: MatchSetup, player: str) -> "Hud":
    """Make the head-up display of a player.

    Raises:
        ConfigError: there is no such player.
    """
    from vrg.ui.hud.goals import Ground  # noqa: PLC0415 - of these two only one is opened
    from vrg.ui.hud.node import Hud  # noqa: PLC0415

    own = setup.player(player)
    bounds, walls = load_map(setup.map).bounds, tuple(setup.obstacles)
    return Hud(
        player,
        Mailbox(),
        setup.keys,
        team=own.team,
        robot=own.robot,
        start=own.pose,
        ground=Ground(bounds, walls, circumradius(own.robot.size)),
        sizes={p.name: p.robot.size for p in setup.players},
        ranging=setup.lasers or own.physical,
        physical=frozenset(setup.physical),
    )


def spectator(on: NodeContext) -> Made:
    """The window of the match, or one more."""
    return _until_closed(on, spectator_node(on.setup, on.name or on.named("window"), on.run, official=on.official))


def hud(on: NodeContext) -> Made:
    """The head-up display of a player."""
    return _until_closed(on, hud_node(on.setup, on.name))


def _until_closed(on: NodeContext, window: WindowNode) -> Made:
    return Made(window, {"ended": None if on.own else gone(on.setup.name, on.router)})
