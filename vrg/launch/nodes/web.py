"""The page that shows a match to browsers."""

from vrg.bus.mailbox import Mailbox
from vrg.kinds import WEB
from vrg.launch.context import DISPLAY_PERIOD, Made, NodeContext
from vrg.ui.web.admission import read_admission
from vrg.ui.web.drawers import DRAWERS, contents
from vrg.ui.web.node import WebNode
from vrg.ui.web.server import WebServer


def web(on: NodeContext) -> Made:
    """The page. The secret of its process tells where it is served, and who may do what: an encoded Admission.

    Raises:
        ValueError: the admission cannot be read.
    """
    setup, drawers = on.setup, contents(on)
    audience = WebServer(read_admission(on.secret), setup.name, {name: DRAWERS.get(name) for name in drawers})
    node = WebNode(
        on.named(WEB.process), Mailbox(), setup.keys, audience,
        robots={player.name: player.robot for player in setup.players}, obstacles=setup.obstacles,
        drawers=drawers, official=on.official,
    )  # fmt: skip
    return Made(node, {"idle": DISPLAY_PERIOD})
