"""The view of a match in three dimensions."""

import contextlib

from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.kinds import THREE
from vrg.launch.context import DISPLAY_PERIOD, Made, NodeContext
from vrg.ui.three.node import ThreeNode
from vrg.ui.three.theatre import Theatre


def theatre(setup: MatchSetup, address: str) -> Theatre:
    """Make what browsers see of a match in three dimensions, running or recorded.

    Args:
        address: where it is served, such as `127.0.0.1:8090`.

    Raises:
        LaunchError: viser is not installed.
    """
    robots, (host, _, port) = {}, address.rpartition(":")
    for player in setup.players:
        # A recording may name a model that is not installed here.
        with contextlib.suppress(ConfigError):
            robots[player.name] = player.robot
    return Theatre(robots, host.strip("[]"), int(port), setup.name)


def three_node(setup: MatchSetup, address: str, name: str) -> ThreeNode:
    """Make the node that shows a match in three dimensions.

    Args:
        name: of the node. address: where it is served, such as `127.0.0.1:8090`.

    Raises:
        LaunchError: viser is not installed.
    """
    robots = {player.name: player.robot for player in setup.players}
    return ThreeNode(name, Mailbox(), setup.keys, theatre(setup, address), robots=robots, obstacles=setup.obstacles)


def three(on: NodeContext) -> Made:
    """The view in three dimensions."""
    return Made(three_node(on.setup, on.name, on.named(THREE.process)), {"idle": DISPLAY_PERIOD})
