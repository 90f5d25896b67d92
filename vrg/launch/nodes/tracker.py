"""What locates the robots of a match."""

from pathlib import Path

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node
from vrg.config.setup import MatchSetup, source_seed
from vrg.hal.location import FUSION
from vrg.hal.sim.map import load_map
from vrg.launch.context import Made, NodeContext
from vrg.localisation.centre import FusionCentre
from vrg.localisation.source import SourceContext, read_source


def tracker_node(setup: MatchSetup, name: str) -> Node:
    """Make a node that locates robots: the fusion centre, or a source of fixes.

    Args:
        name: FUSION, or the name of a source in the match file.

    Raises:
        ConfigError: a robot's model is not installed.
    """
    if name == FUSION:
        robots = {player.name: (player.robot, player.pose) for player in setup.fused}
        physical = [player.name for player in setup.fused if player.physical]
        return FusionCentre(Mailbox(), setup.keys, robots, load_map(setup.map).origin, physical, setup.tracked)
    kind, settings = read_source(setup.localisation[name])
    context = SourceContext(
        name=name,
        settings=settings,
        robots={player.name: player.robot for player in setup.fused},
        starts={player.name: player.pose for player in setup.fused},
        emulated={
            robot: emulation.as_wired(robot, setup.player(robot).robot.drivetrain, Path(setup.base))
            for _, table, robots in setup.backend_settings()
            if (emulation := table.emulation) is not None
            for robot in robots
            if setup.player(robot) in setup.fused
        },
        things=setup.tracked,
        seed=setup.draw(source_seed(name)),
        base=Path(setup.base),
    )
    return kind(context, Mailbox(), setup.keys)


def tracker(on: NodeContext) -> Made:
    """A source of fixes, or the fusion centre."""
    return Made(tracker_node(on.setup, on.name))
