"""The command `vrg run replay`, which shows a recorded match in a window."""

import contextlib
import json
import sys
import tomllib
from collections.abc import Sequence
from datetime import datetime
from functools import partial, reduce
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from vrg.commands.matches import ended_run, need_recording
from vrg.commands.options import (
    AtOption,
    JsonOption,
    RunArgument,
    RunsOption,
    SealedOption,
    ThreeOption,
    echo,
    has_display,
    need_display,
)
from vrg.commands.three import show_replay
from vrg.errors import ConfigError, LaunchError, MessageError

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.recording.recorded import RecordedMatch
    from vrg.runs.change import Change
    from vrg.runs.run_folder import RunFolder
    from vrg.ui.branching import Taken
    from vrg.ui.replay import ReplayWindow

_TELL: Final = 0.5
"""The match time in s between two words about how far it is."""


def replay(
    run: RunArgument = None,
    at: AtOption = None,
    play: Annotated[
        list[str] | None,
        typer.Option(metavar="PLAYER=STRATEGY", help="Play on from --at with another strategy; also TEAM=STRATEGY."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=VALUE", help="Play on from --at by another rule, radio or noise."),
    ] = None,
    runs: RunsOption = Path("runs"),
    sandbox: SealedOption = True,
    as_json: JsonOption = False,
    in_three: ThreeOption = False,
) -> None:
    """Watch a recorded match in a window: pause it, go through it step by step, or from call to call.

    In the window, ? lists the keys. A match that was played in steps (`--in-process`, `--lockstep`) can also be played
    on from any instant with another strategy for one player: `--at 1:20 --play ann=mine.py:Mine`, or the key F; or by
    another rule, another radio or other noise: `--set rules.passes=3`, `--set radio.delay=0.2`, `--set seed=7`. With
    --json that prints lines of JSON, and no window is opened; without --play and --set it prints what was recorded as
    one object.
    """
    folder, setup = ended_run(run, runs)
    if play or settings:
        if at is None:
            raise LaunchError("--play, --set: expected --at too, such as `--at 1:20 --play ann=mine.py:Mine`")
        folder = _take_up(folder, at, play or [], settings or [], runs, sandbox=sandbox, as_json=as_json)
        if as_json or not has_display():
            return
    need_recording(folder)
    if as_json:
        typer.echo(json.dumps(_told(folder, setup)))
        return
    if in_three:
        taken = _read(folder, setup)
        typer.echo(taken.note, nl=bool(taken.note))
        show_replay(taken.timeline, setup, at)
        return
    from vrg.ui.replay import show

    need_display()

    window = replay_window(folder, setup, runs=runs, sandbox=sandbox)
    if at is not None:
        window.playback = window.playback.to(at)
    if window.note:
        echo(window.note)
    show(window)


def _take_up(
    folder: "RunFolder", since: float, plays: list[str], sets: list[str], runs: Path, *, sandbox: bool, as_json: bool
) -> "RunFolder":
    """Play a recorded match on from an instant with changes, and return the new run folder."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from vrg.bus.stopping import stop_on_signals
    from vrg.config.loading import load_match
    from vrg.playing.match import strangers
    from vrg.runs.branch import last_instant, play_branch
    from vrg.runs.brancher import compared
    from vrg.runs.change import amended

    setup = load_match(folder.match_file)
    changes = changes_of(setup, since, plays, sets)
    end = last_instant(folder)
    setup = reduce(amended, changes, setup)
    changed = ", ".join(map(str, changes))
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[time]:.0f} s"), TimeElapsedColumn(),
        console=Console(stderr=True), transient=True, disable=as_json,
    )  # fmt: skip
    printed = -_TELL
    # What strategies print, as when they are imported, must not stand between the lines of JSON.
    out, prints = sys.stdout, contextlib.redirect_stdout(sys.stderr) if as_json else contextlib.nullcontext()

    def progress(time: float) -> None:
        nonlocal printed
        if time < printed + _TELL:
            return
        printed = time
        what = "repeating what was recorded" if time < since else changed
        bar.update(task, description=what, completed=min(time, end), time=time)
        if as_json:
            typer.echo(json.dumps({"time": round(time, 3)}), file=out)

    def announce(text: str) -> None:
        if not as_json:
            echo(text, err=True)

    with (
        strangers(folder, changes, sandbox=sandbox, announce=announce) as apart,
        stop_on_signals() as stop,
        bar,
        prints,
    ):
        task = bar.add_task("repeating what was recorded", total=end, time=0.0)
        new = play_branch(folder, changes, runs, datetime.now(), progress=progress, stop=stop, apart=apart)
    if as_json:
        typer.echo(json.dumps({"run": str(new.path), "ending": compared(folder, new)}))
    else:
        echo(compared(folder, new))
    return new


def changes_of(setup: "MatchSetup", time: float, plays: Sequence[str], sets: Sequence[str]) -> "list[Change]":
    """The changes that `--play` and `--set` name.

    Args:
        time: the match time of their instant, s. plays: each PLAYER=STRATEGY, or TEAM=STRATEGY for all its players.
        sets: each FIELD=VALUE, the value as in a match file; what is none there is a text.

    Raises:
        LaunchError: one is no such text. ConfigError: there is no such player, team or strategy.
    """
    from vrg.runs.change import changes_at

    settings = dict(_split(each, "--set", "FIELD=VALUE, such as rules.passes=3") for each in sets)
    players = dict(_split(each, "--play", "PLAYER=STRATEGY, such as ann=mine.py:Mine") for each in plays)
    return changes_at(setup, time, players, {field: _value(text) for field, text in settings.items()}, "--play")


def _split(typed: str, option: str, expected: str) -> tuple[str, str]:
    name, equals, value = typed.partition("=")
    if not (name and equals and value):
        raise LaunchError(f"{option}: expected {expected}, got {typed!r}")
    return name, value


def _value(typed: str) -> Any:
    """A value as TOML has it."""
    try:
        return tomllib.loads(f"value = {typed}")["value"]
    except tomllib.TOMLDecodeError:
        return typed


def replay_window(
    folder: "RunFolder", setup: "MatchSetup", *, runs: Path = Path("runs"), sandbox: bool = True
) -> "ReplayWindow":
    """Make the window for the recorded match of a run. It is not opened.

    Args:
        runs: the folder for run folders of matches that are taken up from this one. sandbox: their code is sealed.

    Raises:
        LaunchError: the recording cannot be shown.
    """
    from vrg.runs.brancher import ProcessBrancher, compared
    from vrg.runs.change import branch_of
    from vrg.runs.explaining import explain
    from vrg.ui.branching import Taken
    from vrg.ui.replay import ReplayWindow, title_of

    def opened(new: "RunFolder") -> Taken:
        taken = _read(new, setup)
        return Taken(taken.timeline, f"{compared(folder, new)} {taken.note}".strip(), partial(explain, new.path))

    first = _read(folder, setup)
    branch = branch_of(folder)
    note = (
        first.note if branch is None else f"Not what happened: {branch}; recorded in {branch.of}. {first.note}".strip()
    )
    brancher = ProcessBrancher(folder, setup, runs, opened, sandbox=sandbox)
    return ReplayWindow(
        first.timeline, title=title_of(setup.name), note=note, run=folder.path, explain=first.explain, brancher=brancher
    )


def _told(folder: "RunFolder", setup: "MatchSetup") -> dict[str, Any]:
    """The content of a recording: its first and last instant, match time in s, and the calls."""
    taken = _read(folder, setup)
    calls = [{"time": round(call.time, 3), "text": call.text} for call in taken.timeline.calls]
    ends = {"begin": round(taken.timeline.begin, 3), "end": round(taken.timeline.end, 3)}
    return {"run": str(folder.path), **ends, "calls": calls, "note": taken.note}


def _read(folder: "RunFolder", setup: "MatchSetup") -> "Taken":
    """Read the recording of a run for the window.

    Raises:
        LaunchError: the recording cannot be shown.
    """
    from vrg.recording.recorded import read_recorded
    from vrg.runs.explaining import explain
    from vrg.ui.branching import Taken
    from vrg.ui.timeline import Timeline

    try:
        match = read_recorded(folder.recordings())
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
    """The gaps of the recording, in sentences."""
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
    from vrg.games import UNKNOWN_GAME, game_of

    if game_of(setup.game) is not UNKNOWN_GAME:
        return []
    return [f"The game {setup.game} is not installed here: its roles and calls are shown without their own colours."]
