"""The part of the page that the drawer shows."""

from typing import Any

from vrg.bus.messages import DISQUALIFIED
from vrg.ui.web.details import layers, player, referee, streams, tables, words
from vrg.ui.web.details.insight import Insight


def details(insight: Insight) -> dict[str, Any]:
    """Everything about the match, and about the player that is selected.

    Returns:
        `selected` (a player's name, or empty), `out` (it is disqualified), `note` (on the seat of the page), `tabs`
        (a Grid each, in their order), and `layers` (the shapes of each, by its name).
    """
    state = None if insight.state is None else insight.state.player(insight.selected)
    return {
        "t": "details",
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
