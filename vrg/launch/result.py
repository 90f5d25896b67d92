"""What is left when a match has ended: the result, and the plot of the trajectories."""

import json
import logging
from typing import Any

from vrg import __version__
from vrg.bus.messages import RefereeState
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import read_journal
from vrg.errors import JournalError
from vrg.games import game_of
from vrg.launch.run_folder import RunFolder, write_json

log = logging.getLogger(__name__)


def write_result(setup: MatchSetup, folder: RunFolder, state: RefereeState | None, ended: str) -> dict[str, Any]:
    """Write result.json; what cannot be written is told, and still returned.

    Args:
        state: the referee's last.
        ended: `game over`, `interrupted`, or why it failed.
    """
    try:
        _, records = read_journal(folder.journal)
    except JournalError:
        records = []
    result: dict[str, Any] = {
        "match": setup.name,
        "game": setup.game,
        "map": setup.map,
        "engine": setup.engine,
        "seed": setup.seed,
        "ended": ended,
        "winner": state.winner if state else None,
        "score": state.score if state else {},
        "round": state.round if state else None,
        "rounds": state.rounds if state else None,
        "play_time": round(state.total, 3) if state else None,
        "calls": [
            {"clock": round(c.clock, 3), "rule": c.rule, "text": c.text} for record in records for c in record.calls
        ],
        "processes": _statistics(folder),
        "vrg": __version__,
    }
    try:
        write_json(folder.result, result)
    except OSError as error:
        log.error("the result cannot be kept: %s", error)
    return result


def _statistics(folder: RunFolder) -> dict[str, Any]:
    """What each process said of itself when it stopped."""
    found = {}
    for path in sorted(folder.logs.glob("*.json")):
        try:
            found[path.stem] = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
    return found


def plot(setup: MatchSetup, folder: RunFolder) -> None:
    """Draw the trajectories from the recording.

    Raises:
        OSError: no recording, or no room for the picture. ValueError: nobody moved yet.
    """
    from vrg.ui.plot import plot_trajectories  # noqa: PLC0415 - matplotlib takes a second to load

    title = f"{setup.name}: {game_of(setup.game).title}, seed {setup.seed}"
    plot_trajectories(folder.recordings(), folder.plot, title=title)
