"""The command `vrg replay`, which shows a recorded match in a window."""

from typing import TYPE_CHECKING

import typer

from vrg.commands.after import RunArgument, ended_run
from vrg.errors import ConfigError, LaunchError, MessageError

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.launch.run_folder import RunFolder
    from vrg.recording.recorded import RecordedMatch
    from vrg.ui.replay import ReplayWindow


def replay(run: RunArgument) -> None:
    """Watch a recorded match in a window: pause it, go through it step by step, or from call to call.

    In the window, ? lists the keys.
    """
    from vrg.commands.options import need_display
    from vrg.ui.replay import show

    folder, setup = ended_run(run)
    if not folder.recordings():
        raise LaunchError(f"{run}: expected a recording (recording.mcap), found none: was --no-record given?")
    need_display()
    window = window_of(folder, setup)
    if window.note:
        typer.echo(window.note)
    show(window)


def window_of(folder: "RunFolder", setup: "MatchSetup") -> "ReplayWindow":
    """Make the window for the recorded match of a run. It is not opened.

    Raises:
        LaunchError: the recording cannot be shown.
    """
    from vrg.recording.recorded import read_match
    from vrg.ui.replay import ReplayWindow
    from vrg.ui.timeline import Timeline

    try:
        match = read_match(folder.recordings())
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
    return ReplayWindow(timeline, title=f"VRG: {setup.name}, recorded", note=note, run=folder.path)


def _sizes(setup: "MatchSetup") -> tuple[dict[str, tuple[float, float]], list[str]]:
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


def _missing(folder: "RunFolder", match: "RecordedMatch", end: float) -> list[str]:
    """What is missing of the recording, in sentences."""
    from vrg.ui.scene import clock_text

    last = folder.recordings()[-1]
    return [
        f"{part.name} ends in the middle: the match is shown as far as it goes, to {clock_text(end)}."
        if part == last
        else f"{part.name} ends in the middle: something is missing before the next part."
        for part in match.torn
    ]


def _unknown(setup: "MatchSetup") -> list[str]:
    """A sentence about a game that is not installed."""
    from vrg.games import UNKNOWN, game_of

    if game_of(setup.game) is not UNKNOWN:
        return []
    return [f"The game {setup.game} is not installed here: its roles and calls are shown without their own colours."]
