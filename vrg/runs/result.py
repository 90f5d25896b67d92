"""The files that are written when a match has ended: the result, and the plot of the trajectories."""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from vrg import __version__
from vrg.bus.messages import RefereeState
from vrg.config.setup import MatchSetup
from vrg.coordinator.journal import Record, read_journal
from vrg.coordinator.match import won
from vrg.coordinator.rulebook import DRAW, NOBODY
from vrg.errors import FileError, JournalError
from vrg.files import read_json, write_json
from vrg.games import game_of
from vrg.games.game import capitalised
from vrg.runs.run_folder import RunFolder

log = logging.getLogger(__name__)

_LONGEST_PLAY = 1e7
"""The time of play in s above which a result is not believed."""
_LONGEST_STATISTICS = 1_000_000
"""The size in bytes above which the statistics of a process are not believed."""


def write_result(setup: MatchSetup, folder: RunFolder, state: RefereeState | None, ended: str) -> dict[str, Any]:
    """Write result.json, and return its content. If it cannot be written, that is logged.

    Args:
        state: the last state of the referee; None if there is none.
        ended: how the match ended, in words, such as `game over` or `interrupted`.
    """
    result = result_of(setup, folder, state, ended)
    try:
        write_json(folder.result, result)
    except OSError as error:
        log.error("the result cannot be kept: %s", error)
    return result


def result_of(setup: MatchSetup, folder: RunFolder, state: RefereeState | None, ended: str) -> dict[str, Any]:
    """The result of a match; see `write_result`."""
    from vrg.runs.certificate import certificate_of, data_of  # noqa: PLC0415 - it is not needed before the end

    records, processes = _records(folder), _statistics(folder)
    return {
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
            {"clock": round(c.clock, 3), "rule": c.rule, "text": c.text, "why": c.why}
            for record in records
            for c in record.calls
        ],
        "without_evidence": sum(len(record.calls) for record in records if not record.evidence),
        "radio": _radio(processes),
        "refused": {name: found["refused"] for name, found in processes.items() if found.get("refused")},
        "stops": data_of(certificate_of(setup, folder)),
        "processes": processes,
        "vrg": __version__,
    }


def read_result(folder: RunFolder) -> dict[str, Any]:
    """The result that a folder keeps, which anybody may have edited.

    Raises:
        OSError: it cannot be read. FileError: it is no result.
    """
    found = read_json(folder.result)
    played: Any = found.get("play_time") if isinstance(found, dict) else -1.0
    if played is not None and not (type(played) in (int, float) and 0.0 <= played <= _LONGEST_PLAY):
        raise FileError(f"expected a result, with a play_time from 0 to {_LONGEST_PLAY:g} s")
    return cast("dict[str, Any]", found)


def ended_of(state: RefereeState) -> str:
    """The way in which a match that is over has ended, in words."""
    return state.ended or "game over"


def headline(result: dict[str, Any]) -> str:
    """The result of a match, in a few words."""
    if result["ended"] != "game over":
        return capitalised(str(result["ended"]))
    if not game_of(result["game"]).competitive:
        return "Over"
    return "A draw" if result["winner"] == DRAW else capitalised(won(str(result["winner"])))


def conclusion(result: dict[str, Any]) -> str:
    """The result of a match, and why the game was over if its rules tell the reason, in words."""
    if result["ended"] != "game over":
        return headline(result)
    why = next((c.get("why", "") for c in reversed(result["calls"]) if c["rule"] == "game_over"), "")
    return f"{headline(result)}: {why}" if why else headline(result)


def summary(result: dict[str, Any]) -> str:
    """The score and the time of play in brackets, or nothing if there is neither."""
    points = [f"{team} {score}" for team, score in result["score"].items()]
    if result["play_time"] is not None:
        points.append(f"{result['play_time']:.1f} s of play")
    lost, said = result["radio"]["lost"], sum(result["radio"].values())
    if lost:
        points.append(f"the radio lost {lost} of {said} messages")
    refused = sum(sum(keys.values()) for keys in result.get("refused", {}).values())
    if refused:
        points.append(f"{refused} messages with a wrong key refused")
    # Runs of earlier releases have the second name.
    if lacking := result.get("without_evidence", result.get("unproved", 0)):
        points.append(f"{lacking} calls cannot be judged again: their evidence could not be written")
    return f" ({', '.join(points)})" if points else ""


def _records(folder: RunFolder) -> list[Record]:
    """The records of the journal; none if it cannot be read."""
    try:
        return read_journal(folder.journal)[1]
    except JournalError as error:
        log.warning("%s", error)
        return []


def _radio(processes: Mapping[str, Any]) -> dict[str, int]:
    """The numbers of messages of players to players that arrived and that were lost, over all links."""
    links = [link for process in processes.values() for link in process.get("radio", {}).values()]
    return {what: sum(link[what] for link in links) for what in ("arrived", "lost")}


def _statistics(folder: RunFolder) -> dict[str, Any]:
    """The statistics that each process wrote when it stopped, by name."""
    found = {}
    for path in sorted(folder.logs.glob("*.json")):
        try:
            # A player's statistics are written by a process in which a student's code runs.
            read = read_json(path, _LONGEST_STATISTICS)
            _radio({path.stem: read})
            sum(read.get("refused", {}).values())
            found[path.stem] = read
        except (OSError, ValueError, AttributeError, KeyError, TypeError):
            continue  # it is missing, unfinished, or not what such a process writes
    return found


def plot(setup: MatchSetup, folder: RunFolder) -> list[Path]:
    """Draw the trajectories from the recording.

    Returns:
        the parts of the recording that end in the middle or are damaged, of which something is not drawn.

    Raises:
        ModuleNotFoundError: matplotlib is not installed. OSError: there is no recording, or no room for the picture.
        ValueError: the recording has nothing to draw.
    """
    from vrg.ui.plots.plot import plot_trajectories  # noqa: PLC0415 - matplotlib takes a second to load

    records = _records(folder)
    winner = records[-1].standing.winner if records else None
    how = {None: "", NOBODY: "", DRAW: "; a draw"}.get(winner, f"; {won(str(winner))}")
    title = f"{setup.name}: {game_of(setup.game).title}, seed {setup.seed}{how}"
    torn: list[Path] = []
    plot_trajectories(folder.recordings(), folder.plot, obstacles=setup.obstacles, title=title, torn=torn)
    return torn
