"""The command `vrg run replay`, which shows a recorded match in a window."""

import contextlib
import json
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from vrg.commands.added import Added, added_views, typed
from vrg.commands.matches import ended_run, need_shown
from vrg.commands.options import (
    AtOption,
    JsonOption,
    ListenOption,
    RunArgument,
    RunsOption,
    SealedOption,
    echo,
    need_display,
    no_window,
)
from vrg.errors import LaunchError
from vrg.kinds import kind_shown
from vrg.registry import loaded

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.runs.change import Change
    from vrg.runs.run_folder import RunFolder

_TELL: Final = 0.5
"""The match time in s between two words about how far it is."""


@dataclass(frozen=True)
class ViewOptions:
    """The options that show a recorded match elsewhere than in a window."""

    web: Annotated[bool, typer.Option("--web", help="Show the match as a page in browsers.")] = False
    view: Annotated[str | None, typer.Option("--show", metavar="VIEW", help="Show it in a view of `vrg show`.")] = None
    listen: ListenOption = None

    @staticmethod
    def added() -> list[Added]:
        """The options that packages add."""
        return [*added_views("replays")]

    @property
    def views(self) -> list[str]:
        """The views that were asked for, by their names in `vrg show`; all but one are too many."""
        asked = [*(each.view for each in typed(self)), "web" * self.web, self.view or ""]
        return [name for name in asked if name] or ["web"] * (self.listen is not None)


def replay(
    run: RunArgument = None,
    at: AtOption = None,
    play: Annotated[
        list[str] | None,
        typer.Option(metavar="PLAYER=STRATEGY", help="Play on from --at with another strategy; also TEAM=STRATEGY."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=VALUE", help="Play on from --at with another rule, radio or noise."),
    ] = None,
    runs: RunsOption = Path("runs"),
    sandbox: SealedOption = True,
    as_json: JsonOption = False,
    *,
    elsewhere: ViewOptions,
) -> None:
    """Watch a recorded match in a window or in browsers: pause it, go through it step by step, or from call to call.

    In the window, ? lists the keys. A match that was played in steps (`--in-process`, `--lockstep`) can also be played
    on from any instant with another strategy for one player: `--at 1:20 --play ann=mine.py:Mine`, or the key F; or
    with another rule, radio or noise: `--set rules.passes=3`, `--set radio.delay=0.2`, `--set seed=7`. With --json, the
    command prints lines of JSON and opens no window; without --play and --set, it prints the recorded match as one
    object.
    """
    views = elsewhere.views
    if as_json + len(views) > 1:
        names = ", ".join(("--json", *(each.option.name for each in ViewOptions.added()), "--web"))
        raise LaunchError(f"expected one of {names} and --show, got more than one")
    kind = kind_shown(views[0], "replays") if views else None
    folder, setup = ended_run(run, runs)
    if play or settings:
        if at is None:
            raise LaunchError("--play, --set: expected --at too, such as `--at 1:20 --play ann=mine.py:Mine`")
        folder = _take_up(folder, at, play or [], settings or [], runs, sandbox=sandbox, as_json=as_json)
        if as_json:
            return
        if kind is None and (why := no_window()):
            echo(f"no window: {why}", err=True)
            return
    need_shown(folder)
    if as_json:
        typer.echo(json.dumps(_told(folder, setup)))
        return
    if kind is not None:
        from vrg.playing.replay import read_for_window

        taken = read_for_window(folder, setup)
        typer.echo(taken.note, nl=bool(taken.note))
        loaded(kind.replays, f"--show {kind.shown}")(taken.timeline, setup, at, elsewhere.listen)
        return
    from vrg.playing.replay import replay_window
    from vrg.ui.window.replay import show

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
    from vrg.playing.branch import last_instant, play_branch
    from vrg.playing.brancher import compared
    from vrg.playing.match import strangers
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


def _told(folder: "RunFolder", setup: "MatchSetup") -> dict[str, Any]:
    """The content of a recording: its first and last instant, match time in s, and the calls."""
    from vrg.playing.replay import read_for_window

    taken = read_for_window(folder, setup)
    calls = [{"time": round(call.time, 3), "text": call.text} for call in taken.timeline.calls]
    ends = {"begin": round(taken.timeline.begin, 3), "end": round(taken.timeline.end, 3)}
    return {"run": str(folder.path), **ends, "calls": calls, "note": taken.note}
