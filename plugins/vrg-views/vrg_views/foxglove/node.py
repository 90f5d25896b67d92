"""What Foxglove connects to while a match is played."""

from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup
from vrg.launch.context import DISPLAY_PERIOD, Made, NodeContext
from vrg_views.foxglove import KIND
from vrg_views.foxglove.live import LiveRecorder, LiveServer


def live_node(setup: MatchSetup, address: str, name: str) -> LiveRecorder:
    """Make the node that shows in Foxglove, while a match is played, what a recorder would write.

    Args:
        name: of the node. address: where its server listens, such as `127.0.0.1:8765`.
    """
    host, _, port = address.rpartition(":")
    return LiveRecorder(
        name,
        Mailbox(),
        setup.keys,
        lambda: LiveServer(setup.name, host.strip("[]"), int(port)),
        models={player.name: player.robot for player in setup.players},
        obstacles=setup.obstacles,
    )


def foxglove(on: NodeContext) -> Made:
    """What Foxglove connects to."""
    return Made(live_node(on.setup, on.name, on.named(KIND.process)), {"idle": DISPLAY_PERIOD})
