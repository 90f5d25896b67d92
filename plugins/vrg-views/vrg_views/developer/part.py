"""What the drawer shows, as plain data for the page."""

from typing import Any

from vrg.bus.messages import DISQUALIFIED
from vrg.launch.context import NodeContext
from vrg.ui.scene import Scene
from vrg_views.developer import layers, player, referee, streams, tables, words
from vrg_views.developer.insight import Hearing, Insight
from vrg_views.developer.traffic import Traffic


def details(insight: Insight) -> dict[str, Any]:
    """Everything about the match, and about the player that is selected.

    Returns:
        `selected` (a player's name, or empty), `out` (it is disqualified), `note` (on the seat of the page), `tabs`
        (a Grid each, in their order), and `layers` (the shapes of each, by its name).
    """
    state = None if insight.state is None else insight.state.player(insight.selected)
    return {
        "selected": insight.selected,
        "out": state is not None and state.state == DISQUALIFIED,
        "note": "" if insight.official else words.WINDOW_SEAT,
        "tabs": {
            "players": tables.players(insight),
            "player": player.player(insight),
            "referee": referee.referee(insight),
            "streams": streams.streams(insight),
            "processes": tables.processes(insight),
        },
        "layers": layers.shapes(insight),
    }


class Details(Hearing):
    """What the drawer shows of a match: a `vrg.ui.web.drawers.Content`."""

    def part(self, now: float, scene: Scene, player: str) -> dict[str, Any]:
        """See `details`."""
        return details(self.insight(now, scene, player))


def made(on: NodeContext) -> Details:
    """The content of the drawer, which hears what the seat of the page may hear."""
    keys, traffic = on.setup.keys, Traffic(on.setup.keys)
    traffic.attach(on.join())
    return Details(keys, traffic, {player.name: player.robot for player in on.setup.players}, official=on.official)
