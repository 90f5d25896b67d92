"""The page that shows a match to browsers."""

from vrg.bus.mailbox import Mailbox
from vrg.config.setup import MatchSetup
from vrg.kinds import WEB
from vrg.launch.context import DISPLAY_PERIOD, Made, NodeContext
from vrg.ui.web.admission import read_admission
from vrg.ui.web.node import WebNode
from vrg.ui.web.server import WebServer


def web_node(setup: MatchSetup, admission: str, name: str, *, official: bool = True) -> WebNode:
    """Make the node that shows a match to browsers.

    Args:
        name: of the node. admission: where it is served, and who may do what: an encoded
            `vrg.ui.web.admission.Admission`.
        official: False if its seat may only watch and stop everything.

    Raises:
        ValueError: the admission cannot be read.
    """
    robots = {player.name: player.robot for player in setup.players}
    audience = WebServer(read_admission(admission), setup.name)
    return WebNode(name, Mailbox(), setup.keys, audience, robots=robots, obstacles=setup.obstacles, official=official)


def web(on: NodeContext) -> Made:
    """The page."""
    node = web_node(on.setup, on.secret, on.named(WEB.process), official=on.official)
    node.traffic.attach(on.join())
    return Made(node, {"idle": DISPLAY_PERIOD})
