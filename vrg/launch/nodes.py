"""Makes the nodes of a match from its set-up. They are the same for every executor.

Each node is imported when it is made, so that a process loads only what it needs. Above all, in a match of several
processes only a player's own process imports a student's code.
"""

import contextlib
import logging
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from vrg.blame import failure_of
from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup, radio_seed, source_seed, team_seed
from vrg.errors import ConfigError, StrategyError
from vrg.launch.run_folder import RunFolder
from vrg.modules import no_method

if TYPE_CHECKING:
    from vrg.agents.player import Player
    from vrg.agents.strategy import Strategy
    from vrg.bus.node import Node
    from vrg.bus.session import Session
    from vrg.coordinator.coordinator import Coordinator
    from vrg.coordinator.journal import Journal, NoJournal
    from vrg.hal.can.link import Medium
    from vrg.hal.models import RobotModel
    from vrg.hal.sim.node import WorldNode
    from vrg.recording.live import LiveRecorder
    from vrg.recording.recorder import Recorder
    from vrg.ros.publisher import RosPublisher
    from vrg.ui.developer.node import DeveloperWindow
    from vrg.ui.hud.node import Hud
    from vrg.ui.spectator import Spectator
    from vrg.ui.three.node import ThreeNode
    from vrg.ui.three.theatre import Theatre
    from vrg.ui.web.node import WebNode

log = logging.getLogger(__name__)

T = TypeVar("T")


def world_node(setup: MatchSetup) -> "WorldNode":
    """Make the world of a match.

    Raises:
        ConfigError: the set-up of the world has problems.
    """
    from vrg.hal.sim.node import WorldNode

    return WorldNode(setup.world, Mailbox(), setup.keys)


def open_journal(setup: MatchSetup, folder: RunFolder, *, aside: bool = False) -> "Journal":
    """Open the journal of a match, a new one or the one that is in the run folder.

    Args:
        aside: see `vrg.coordinator.journal.Journal`.

    Raises:
        JournalError: it cannot be used; see `Journal`.
    """
    from vrg.coordinator.journal import Journal, JournalHeader

    return Journal(folder.journal, JournalHeader(match=setup.name, game=setup.game, seed=setup.seed), aside=aside)


def coordinator_node(setup: MatchSetup, journal: "Journal | NoJournal") -> "Coordinator":
    """Make the coordinator of a match.

    Raises:
        ConfigError: the rules cannot be played with this set-up.
    """
    from vrg.config.rules import rulebook_of
    from vrg.coordinator.coordinator import Coordinator
    from vrg.coordinator.leading import Leader

    leader = Leader({player.name: player.robot.v_max for player in setup.players}, setup.obstacles)
    disqualify = setup.on_fault == "disqualify"
    return Coordinator(
        Mailbox(),
        setup.keys,
        rulebook_of(setup),
        journal,
        leader=leader,
        sight=setup.sight,
        disqualify=disqualify,
        fused=[player.name for player in setup.fused],
    )


def strategy_class(target: str, base: Path) -> "type[Strategy]":
    """The class of a strategy: `module:Class`, `file.py:Class`, `policy.npz`, or the name of a registered one.

    Raises:
        ConfigError: there is none, it cannot be imported or read, or it is no strategy.
    """
    from vrg.agents.importing import import_object
    from vrg.agents.strategy import Strategy
    from vrg.games import STRATEGIES, STRATEGY_FILES, is_strategy_file

    kind: object
    if is_strategy_file(target):
        kind = STRATEGY_FILES.get(Path(target).suffix[1:])(base / target)
    else:
        kind = import_object(target, base) if ":" in target else STRATEGIES.get(target)
    if not (isinstance(kind, type) and issubclass(kind, Strategy)):
        raise ConfigError(f"{target}: expected a subclass of vrg.agents.Strategy, got {kind!r}")
    if lacking := sorted(kind.__abstractmethods__):
        raise ConfigError(no_method(target, lacking[0], vars(kind)))
    return kind


def strategy_of(setup: MatchSetup, name: str) -> "Strategy":
    """Import and make the strategy of a player.

    Raises:
        ConfigError: there is no such player, or its strategy cannot be imported or made, is no Strategy, or is one for
            other games.
    """
    from vrg.agents.planner import Planner
    from vrg.games import PLANNERS

    player = setup.player(name)
    kind = strategy_class(player.strategy, Path(setup.base))
    if kind.games and setup.game not in kind.games:
        able = ", ".join(kind.games)
        raise ConfigError(f"{player.strategy}: expected a strategy for {setup.game}, got one that plays {able} alone")
    strategy = _made(player.strategy, kind, name, player.robot)
    # numpy's older generators take no more than 32 bits.
    strategy.seed = setup.draw(team_seed(player.team)) % 2**32
    if setup.planner is not None:
        planner = PLANNERS.get(setup.planner)
        if not issubclass(planner, Planner):
            raise ConfigError(f"{setup.planner}: expected a subclass of vrg.agents.planner.Planner, got {planner!r}")
        strategy.planner = _made(setup.planner, planner, name, player.robot)
    return strategy


def _made(target: str, kind: "Callable[[str, RobotModel], T]", name: str, robot: "RobotModel") -> T:
    """Make what `target` names, a strategy or a planner, for a player and its robot.

    Raises:
        ConfigError: it cannot be made.
    """
    try:
        return kind(name, robot)
    except (Exception, SystemExit) as error:
        raise ConfigError(f"{target}: cannot be made: {failure_of(error)}") from error


def player_node(
    setup: MatchSetup,
    name: str,
    medium: "Medium | None" = None,
    make: "Callable[[], Strategy] | None" = None,
) -> "Player":
    """Make a player with its device and its strategy.

    Args:
        medium: the CAN buses of its robot; None for those of this computer.
        make: makes its strategy; None makes it in this process.

    Raises:
        ConfigError: there is no such player, or its driver cannot be made.
        StrategyError: its strategy cannot be made.
    """
    from vrg.agents.player import Player
    from vrg.bus.links import link_of
    from vrg.bus.radio import Radio
    from vrg.hal.backends import MatchContext, open_driver
    from vrg.hal.clock import REAL_CLOCK
    from vrg.hal.device import Device

    player = setup.player(name)
    try:
        strategy = strategy_of(setup, name) if make is None else make()
    except ConfigError as error:
        raise StrategyError(str(error), final=True) from error
    mailbox, keys = Mailbox(), setup.keys
    context = MatchContext(
        name=name,
        model=player.robot,
        options=setup.backends.get(player.backend, {}),
        base=Path(setup.base),
        now=lambda: mailbox.now,
        medium=medium,
        keys=keys,
        mailbox=mailbox,
    )
    driver = open_driver(player.backend, context)
    clock = REAL_CLOCK if medium is None else medium.clock
    device = Device(driver, keys, mailbox, start=player.pose, localisation=player.localisation, clock=clock)
    radio = Radio(keys, mailbox, name, player.team, link_of(setup.radio.settings, setup.draw(radio_seed(name))))
    return Player(mailbox, keys, device, strategy, team=player.team, radio=radio, obstacles=setup.obstacles)


def tracker_node(setup: MatchSetup, name: str) -> "Node":
    """Make a node that locates robots: the fusion centre, or a source of fixes.

    Args:
        name: FUSION, or the name of a source in the match file.

    Raises:
        ConfigError: a robot's model is not installed.
    """
    from vrg.hal.location import FUSION
    from vrg.hal.sim.map import load_map
    from vrg.localisation.centre import FusionCentre
    from vrg.localisation.source import SourceContext, read_source

    if name == FUSION:
        robots = {player.name: (player.robot, player.pose) for player in setup.fused}
        physical = [player.name for player in setup.fused if player.physical]
        return FusionCentre(Mailbox(), setup.keys, robots, load_map(setup.map).origin, physical)
    kind, settings = read_source(setup.localisation[name])
    context = SourceContext(
        name=name,
        settings=settings,
        robots={player.name: player.robot for player in setup.fused},
        starts={player.name: player.pose for player in setup.fused},
        emulated={
            robot: table.as_wired(robot, setup.player(robot).robot.drivetrain, Path(setup.base))
            for _, table, robots in setup.backend_settings()
            for robot in robots
            if table.emulated and setup.player(robot) in setup.fused
        },
        seed=setup.draw(source_seed(name)),
        base=Path(setup.base),
    )
    return kind(context, Mailbox(), setup.keys)


def recorder_node(setup: MatchSetup, folder: RunFolder) -> "Recorder":
    """Make the recorder, which records a match for Foxglove."""
    from vrg.recording.recorder import Recorder

    return Recorder(
        "recorder",
        Mailbox(),
        setup.keys,
        folder.recording,
        models={player.name: player.robot for player in setup.players},
        obstacles=setup.obstacles,
    )


def live_node(setup: MatchSetup, address: str, name: str) -> "LiveRecorder":
    """Make the node that shows in Foxglove, while a match is played, what a recorder would write.

    Args:
        name: of the node. address: where its server listens, such as `127.0.0.1:8765`.

    Raises:
        LaunchError: Foxglove's SDK is not installed.
    """
    from vrg.recording.live import LiveRecorder, LiveServer

    host, _, port = address.rpartition(":")
    return LiveRecorder(
        name,
        Mailbox(),
        setup.keys,
        lambda: LiveServer(setup.name, host.strip("[]"), int(port)),
        models={player.name: player.robot for player in setup.players},
        obstacles=setup.obstacles,
    )


def three_node(setup: MatchSetup, address: str, name: str) -> "ThreeNode":
    """Make the node that shows a match in three dimensions.

    Args:
        name: of the node. address: where it is served, such as `127.0.0.1:8090`.

    Raises:
        LaunchError: viser is not installed.
    """
    from vrg.ui.three.node import ThreeNode

    robots = {player.name: player.robot for player in setup.players}
    return ThreeNode(name, Mailbox(), setup.keys, theatre(setup, address), robots=robots, obstacles=setup.obstacles)


def ros_node(
    setup: MatchSetup, where: str, join: "Callable[[str], Session]", *, name: str, official: bool = True
) -> "RosPublisher":
    """Make the node that shows a match to ROS 2.

    Args:
        where: the domain, and the router of the ROS nodes, such as `0@tcp/127.0.0.1:7448`; without one it is that of
            the match. join: returns a session with a router; with that of the match if it is empty.
        name: of the node. official: True if the seat of this process may drive players.

    Raises:
        ConfigError: two players have the same name in ROS 2.
    """
    from vrg.ros.graph import RosNode
    from vrg.ros.publisher import RosPublisher
    from vrg.ros.wire import ros_name

    domain, _, router = where.partition("@")
    namespace = f"/{ros_name(setup.name)}"
    graph = RosNode(join(router), int(domain), "vrg", namespace)
    names = Counter(ros_name(player.name) for player in setup.players)
    if alike := [player.name for player in setup.players if names[ros_name(player.name)] > 1]:
        raise ConfigError(f"expected players whose names differ in ROS 2, too, where {', '.join(alike)} are the same")
    wanted = setup.driven_by_ros
    if wanted and not official:
        log.warning("a window's keys drive no player: cmd_vel of %s needs those of the official", ", ".join(wanted))
    driven = {one: graph.commands(f"{namespace}/{ros_name(one)}/cmd_vel") for one in wanted if official}
    robots = {player.name: player.robot for player in setup.players}
    return RosPublisher(
        name, Mailbox(), setup.keys, namespace, graph, robots=robots, obstacles=setup.obstacles, driven=driven
    )


def theatre(setup: MatchSetup, address: str) -> "Theatre":
    """Make what browsers see of a match in three dimensions, running or recorded.

    Args:
        address: where it is served, such as `127.0.0.1:8090`.

    Raises:
        LaunchError: viser is not installed.
    """
    from vrg.ui.three.theatre import Theatre

    robots, (host, _, port) = {}, address.rpartition(":")
    for player in setup.players:
        # A recording may name a model that is not installed here.
        with contextlib.suppress(ConfigError):
            robots[player.name] = player.robot
    return Theatre(robots, host.strip("[]"), int(port), setup.name)


def spectator_node(setup: MatchSetup, name: str, run: Path | None, *, official: bool = True) -> "Spectator":
    """Make a window that shows a match, with the map's walls and the robots' real sizes.

    Args:
        name: the name of the node.
        run: the run folder, for pictures that its user takes and to explain calls; None if it is not on this machine.
        official: False if its user may only watch and stop everything.
    """
    from vrg.launch.explaining import explain
    from vrg.ui.spectator import Spectator

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


def developer_node(setup: MatchSetup, name: str, run: Path | None, *, official: bool = True) -> "DeveloperWindow":
    """Make the developers' view of a match.

    Args:
        name: the name of the node. run: the run folder, as for `spectator_node`.
        official: whether it has an official's seat.
    """
    from vrg.bus.traffic import Traffic
    from vrg.launch.explaining import explain
    from vrg.ui.developer.node import DeveloperWindow

    return DeveloperWindow(
        name,
        Mailbox(),
        setup.keys,
        Traffic(setup.keys),
        robots={player.name: player.robot for player in setup.players},
        obstacles=setup.obstacles,
        run=run,
        explain=None if run is None else partial(explain, run),
        official=official,
    )


def hud_node(setup: MatchSetup, player: str) -> "Hud":
    """Make the head-up display of a player.

    Raises:
        ConfigError: there is no such player.
    """
    from vrg.geometry import circumradius
    from vrg.hal.sim.map import load_map
    from vrg.ui.hud.goals import Ground
    from vrg.ui.hud.node import Hud

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


def web_node(setup: MatchSetup, admission: str) -> "WebNode":
    """Make the node that shows a match to browsers.

    Args:
        admission: where it is served, and who may do what: an encoded `vrg.ui.web.admission.Admission`.

    Raises:
        ValueError: the admission cannot be read.
    """
    from vrg.config.files import WEB
    from vrg.ui.web.admission import read_admission
    from vrg.ui.web.node import WebNode
    from vrg.ui.web.server import WebServer

    sizes = {player.name: player.robot.size for player in setup.players}
    audience = WebServer(read_admission(admission), setup.name)
    return WebNode(WEB, Mailbox(), setup.keys, audience, sizes=sizes, obstacles=setup.obstacles)
