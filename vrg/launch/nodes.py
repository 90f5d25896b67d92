"""The nodes of a match, made from its set-up: the same ones for every executor."""

from pathlib import Path
from typing import TYPE_CHECKING

from vrg.agents.player import Player
from vrg.bus.foxglove_scene import Shape
from vrg.bus.mailbox import Mailbox
from vrg.bus.recording import Recorder
from vrg.config import MatchSetup
from vrg.coordinator.coordinator import Coordinator
from vrg.coordinator.journal import Header, Journal
from vrg.hal.backends import RobotContext, open_robot
from vrg.hal.models import robot_model
from vrg.hal.sim.map import load_map
from vrg.hal.sim.world_node import WorldNode
from vrg.launch.run_folder import RunFolder

if TYPE_CHECKING:
    from vrg.ui.spectator import Spectator


def world_node(setup: MatchSetup) -> WorldNode:
    """The world of a match."""
    return WorldNode(setup.world, Mailbox(), setup.keys)


def open_journal(setup: MatchSetup, folder: RunFolder) -> Journal:
    """The journal of a match, new or to go on with.

    Raises:
        JournalError: see `Journal`.
    """
    file = setup.file
    return Journal(folder.journal, Header(match=file.name, game=file.game, seed=file.seed))


def coordinator_node(setup: MatchSetup, journal: Journal) -> Coordinator:
    """The referee of a match."""
    return Coordinator(
        Mailbox(),
        setup.keys,
        setup.rulebook(),
        journal,
        seed=setup.file.seed,
        lineup_limit=getattr(setup.settings, "lineup_limit", 60.0),
    )


def player_node(setup: MatchSetup, name: str) -> Player:
    """A player with its robot and its strategy.

    Raises:
        ConfigError: no such player. RobotError: its robot cannot be reached.
    """
    entry = setup.player(name)
    mailbox = Mailbox()
    context = RobotContext(
        name=name,
        model=robot_model(entry.model),
        keys=setup.keys,
        mailbox=mailbox,
        start=entry.pose,
        base=setup.base,
        options=setup.file.backends.get(entry.backend, {}),
    )
    return Player(mailbox, setup.keys, open_robot(entry.backend, context), setup.strategy(name))


def recorder_node(setup: MatchSetup, folder: RunFolder) -> Recorder:
    """What records a match for Foxglove."""
    shapes = {
        p.name: Shape(length=m.length, width=m.width, height=m.height, laser_x=m.laser.x if m.laser else 0.0)
        for p in setup.file.players
        for m in [robot_model(p.model)]
    }
    return Recorder("recorder", Mailbox(), setup.keys, folder.recording, shapes=shapes)


def spectator_node(setup: MatchSetup, name: str, pictures: Path) -> "Spectator":
    """A window on a match, with the map's walls and the robots' real sizes.

    Args:
        pictures: folder for the pictures that its user takes.
    """
    from vrg.ui.spectator import Spectator  # noqa: PLC0415 - a machine without a display needs no pygame

    map_ = load_map(setup.world.map)
    models = {p.name: robot_model(p.model) for p in setup.file.players}
    return Spectator(
        name,
        Mailbox(),
        setup.keys,
        sizes={n: (m.length, m.width) for n, m in models.items()},
        segments=[(x0, y0, x1, y1) for x0, y0, x1, y1 in map_.edges.tolist()],
        circles=[(x, y, r) for x, y, r in map_.discs.tolist()],
        pictures=pictures,
    )
