"""The nodes of a match, made from its set-up: the same ones for every executor."""

from vrg.agents.player import Player
from vrg.bus.mailbox import Mailbox
from vrg.config import MatchSetup
from vrg.coordinator.journal import Header, Journal
from vrg.coordinator.node import Coordinator
from vrg.hal.backends import RobotContext, open_robot
from vrg.hal.models import robot_model
from vrg.hal.sim.node import WorldNode
from vrg.launch.run_folder import RunFolder


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
    context = RobotContext(name=name, model=robot_model(entry.model), keys=setup.keys, mailbox=mailbox)
    return Player(mailbox, setup.keys, open_robot(entry.backend, context), setup.strategy(name))
