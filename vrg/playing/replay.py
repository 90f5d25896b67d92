"""A recorded match as the window of a replay shows it."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError, LaunchError, MessageError
from vrg.games import UNKNOWN_GAME, game_of
from vrg.playing.brancher import ProcessBrancher, compared
from vrg.recording.recorded import RecordedMatch, read_recorded
from vrg.runs.change import branch_of
from vrg.runs.evidenced import read_evidenced
from vrg.runs.explaining import explain
from vrg.runs.run_folder import RunFolder
from vrg.ui.branching import Taken
from vrg.ui.scene import clock_text
from vrg.ui.timeline import Timeline

if TYPE_CHECKING:
    from vrg.ui.window.replay import ReplayWindow


def replay_window(
    folder: RunFolder, setup: MatchSetup, *, runs: Path = Path("runs"), sandbox: bool = True
) -> "ReplayWindow":
    """Make the window for the recorded match of a run. It is not opened.

    Args:
        runs: the folder for run folders of matches that are taken up from this one. sandbox: their code is sealed.

    Raises:
        LaunchError: the recording cannot be shown.
    """
    from vrg.ui.window.replay import ReplayWindow, title_of  # noqa: PLC0415 - what is printed needs no window

    def opened(new: RunFolder) -> Taken:
        taken = read_for_window(new, setup)
        return Taken(taken.timeline, f"{compared(folder, new)} {taken.note}".strip(), partial(explain, new.path))

    first = read_for_window(folder, setup)
    branch = branch_of(folder)
    note = (
        first.note if branch is None else f"Not what happened: {branch}; recorded in {branch.of}. {first.note}".strip()
    )
    brancher = ProcessBrancher(folder, setup, runs, opened, sandbox=sandbox)
    return ReplayWindow(
        first.timeline, title=title_of(setup.name), note=note, run=folder.path, explain=first.explain, brancher=brancher
    )


def read_for_window(folder: RunFolder, setup: MatchSetup) -> Taken:
    """Read the recording of a run for the window; the evidence where nothing was recorded.

    Raises:
        LaunchError: neither can be shown. JournalError: the journal or the evidence cannot be read.
    """
    try:
        match = read_recorded(folder.recordings()) if folder.recordings() else read_evidenced(folder, setup)
        sizes, strange = _sizes(setup)
        timeline = Timeline(match, sizes=sizes, obstacles=setup.obstacles)
    except OSError as error:
        raise LaunchError(f"{folder.path}: its recording cannot be read: {error}") from None
    except MessageError as error:
        hint = "if another version of VRG has recorded it, use that one"
        raise LaunchError(f"{folder.path}: its recording cannot be shown: {error}: {hint}") from None
    except ValueError as error:
        raise LaunchError(f"{folder.path}: its recording cannot be shown: {error}") from None
    note = " ".join([*_missing(folder, match, timeline.end), *_unknown(setup), *strange])
    return Taken(timeline, note, partial(explain, folder.path))


def _sizes(setup: MatchSetup) -> tuple[dict[str, tuple[float, float]], list[str]]:
    """Length and width of the robots in m, by name, and a sentence for those whose model is not known here."""
    sizes, strange = {}, set[str]()
    for player in setup.players:
        try:
            sizes[player.name] = player.robot.size
        except ConfigError:
            strange.add(player.model)
    return sizes, [
        f"The robot model {model} is not installed here: its robots are shown 0.5 m long." for model in sorted(strange)
    ]


def _missing(folder: RunFolder, match: RecordedMatch, end: float) -> list[str]:
    """The gaps of the recording, in sentences."""
    if not folder.recordings():
        return ["Nothing was recorded: the match is shown as the referee saw it, from its evidence."]
    last = folder.recordings()[-1]
    return [
        f"{part.name} ends in the middle: the match is shown as far as it goes, to {clock_text(end)}."
        if part == last
        else f"{part.name} ends in the middle: something is missing before the next part."
        for part in match.torn
    ]


def _unknown(setup: MatchSetup) -> list[str]:
    """A sentence about a game that is not installed."""
    if game_of(setup.game) is not UNKNOWN_GAME:
        return []
    return [f"The game {setup.game} is not installed here: its roles and calls are shown without their own colours."]
