"""The arguments and options that several commands share, each declared once, and what they mean."""

import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vrg.bus.messages import REASON_LENGTH
from vrg.bus.stopping import Stop, stop_on_signals
from vrg.errors import ConfigError, LaunchError
from vrg.files import write_whole
from vrg.hosts import netloc
from vrg.types import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text


def duration(least: float = 0.0, most: float = math.inf) -> Callable[[str | float], float]:
    """Return a parser of a time in seconds, such as `80`, `80.5` or `1:20`, within bounds.

    Its function raises a typer.BadParameter for anything else.
    """

    def read(text: str | float) -> float:
        try:
            parts = [float(part) for part in str(text).split(":")]
        except ValueError:
            parts = []
        value = sum(part * 60.0**power for power, part in enumerate(reversed(parts)))
        wrong = any(part < 0 for part in parts) or any(part >= 60 for part in parts[1:])
        if wrong or not 1 <= len(parts) <= 3 or not least <= value <= most:
            bounds = f"of at least {least:g}" if math.isinf(most) else f"from {least:g} to {most:g}"
            raise typer.BadParameter(f"expected a time {bounds} s, such as 80 or 1:20, got {text!r}")
        return value

    return read


TIME = "SECONDS|M:SS"
"""The form of a time."""


def lasting(text: str, least: float = 0.0, most: float = math.inf) -> Any:
    """The option --for, with a help text: how long something lasts, within bounds, s."""
    return typer.Option("--for", metavar=TIME, parser=duration(least, most), help=text)


def _short(reason: str) -> str:
    if len(reason) > REASON_LENGTH:
        raise typer.BadParameter(f"expected at most {REASON_LENGTH} characters, got {len(reason)}")
    return reason


def _known_engine(engine: str | None) -> str | None:
    if engine is None:
        return None
    from vrg.hal.sim.engines import ENGINES  # it loads numpy, which only --engine needs

    if engine not in ENGINES:
        raise typer.BadParameter(ENGINES.unknown(engine))
    return engine


# What a command is about. It stands before the match or the run.
PlayerArgument = Annotated[str, typer.Argument(metavar="PLAYER", help="Name of a player, and of its robot.")]
TeamArgument = Annotated[str, typer.Argument(metavar="TEAM", help="Name of a team, such as red.")]
StrategyArgument = Annotated[
    str, typer.Argument(metavar="STRATEGY", help="A strategy's name, file.py:Class, module:Class, or policy.npz.")
]

# A match that is to be played, one that runs, one that was played.
GameArgument = Annotated[
    str, typer.Argument(metavar="GAME|match.toml", help="A match file, or a game's name for its default match.")
]
MatchArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="[MATCH]",
        help="The running match: its name, match file, game or run folder; the default is the one that runs here.",
    ),
]
RouterOption = Annotated[
    str | None, typer.Option("--router", metavar="ENDPOINT", help="The match's router, such as tcp/192.168.1.5:7447.")
]
KEYS_VARIABLE = "VRG_KEYS"
"""The variable that may name the folder of the keys in place of --keys."""
KeysOption = Annotated[
    Path | None,
    typer.Option("--keys", envvar=KEYS_VARIABLE, help="Folder of the keys of the match's seats; see `vrg keys`."),
]
MatchKeysOption = Annotated[
    Path | None,
    typer.Option("--keys", help=f"Folder of the keys of the match's seats; by default its own, or {KEYS_VARIABLE}."),
]
"""For a match that runs: what was typed stands above what the match has recorded, and the variable below."""
ReasonOption = Annotated[str, typer.Option("--reason", callback=_short, help="The reason, for the journal.")]
RunArgument = Annotated[
    Path | None,
    typer.Argument(metavar="[RUN]", help="A run folder, or its name in the folder runs; the default is the newest."),
]
RunsOption = Annotated[Path, typer.Option("--runs", help="Folder of the run folders.")]
RunOption = Annotated[Path | None, typer.Option("--run", help="Run folder to write to.")]

# How a match is played.
EngineOption = Annotated[
    str | None, typer.Option(callback=_known_engine, help="Physics engine that replaces the match file's.")
]
SandboxOption = Annotated[
    bool | None,
    typer.Option(
        "--sandbox/--no-sandbox",
        help="Seal the processes of strategies; the default is the match file's. With --no-sandbox they can do all "
        "that you can, and with --in-process files decide in the match's own process: faster, for your own code.",
    ),
]
SealedOption = Annotated[
    bool,
    typer.Option(
        "--sandbox/--no-sandbox",
        help="Seal the code of players' files: a run may come from anybody. Without, it can do all that you can.",
    ),
]

# When, where and in which form.
AtOption = Annotated[float | None, typer.Option("--at", metavar=TIME, parser=duration(), help="The match time.")]
PoseOption = Annotated[
    tuple[float, float, float] | None,
    typer.Option("--pose", metavar="X Y HEADING", help="Where it is, in m and degrees; by default, its own place."),
]
ListenOption = Annotated[
    str | None,
    typer.Option(
        "--listen", metavar="HOST[:PORT]", help="Address to serve at: 0.0.0.0 for all; by default this machine only."
    ),
]
TlsOption = Annotated[
    bool, typer.Option("--tls", help="Serve the page over https, with a certificate that browsers warn about once.")
]
OutputOption = Annotated[Path | None, typer.Option("--output", "-o", help="File or folder to write.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
LeashOption = Annotated[bool, typer.Option("--leash", hidden=True)]


@contextmanager
def stoppable() -> Iterator[Stop]:
    """A Stop that SIGINT and SIGTERM set.

    Raises:
        typer.Exit: at the end of the context, with status 130, if Ctrl-C was pressed.
    """
    with stop_on_signals() as stop:
        yield stop
    exit_if_interrupted(stop)


def exit_if_interrupted(stop: Stop) -> None:
    """End the command with status 130 if Ctrl-C was pressed.

    Raises:
        typer.Exit: it was.
    """
    if stop.interrupted:
        raise typer.Exit(130)


def exit_if_stopped(stop: Stop) -> None:
    """End a command that finds something out, and has not, with the status of a program that the signal has ended.

    Raises:
        typer.Exit: a signal has stopped it, such as SIGTERM.
    """
    if stop.signal is not None:
        raise typer.Exit(128 + stop.signal)


def echo(text: str, *, err: bool = False) -> None:
    """Print a text that may hold words from files of others: these steer no terminal."""
    typer.echo(printable(text, lines=True), err=err)


def make_console(*, stderr: bool = False) -> "Console":
    """The console of a command, for its output or, with `stderr`, for remarks.

    Names are printed as they are: `mine.py:Shark:` is no picture.

    Where the output is no terminal, whose width is known, there is room for all columns of a table. Text from
    files of others steers no terminal.
    """
    from rich.console import Console as RichConsole  # a decision of an official shows no table

    class Console(RichConsole):
        """A console that prints signs of control as they are written in Python."""

        def render_str(self, text: str, **options: Any) -> "Text":
            """The text with its markup."""
            return super().render_str(printable(text, lines=True), **options)

    wide = None if sys.stdout.isatty() or "COLUMNS" in os.environ else 160
    return Console(highlight=False, emoji=False, width=wide, stderr=stderr)


def print_table(console: "Console", heads: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[int]) -> None:
    """Print a table of texts.

    Args:
        right: the numbers of the columns that stand at the right.
    """
    from rich.markup import escape
    from rich.table import Table

    table = Table()
    for number, head in enumerate(heads):
        table.add_column(escape(head), justify="right" if number in right else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    console.print(table)


def no_window() -> str | None:
    """Why no window can be opened, and what to do, in words; None if one can."""
    from vrg.packages import lacking  # few commands open a window

    instead = "watch in a browser, with --web or `vrg show web`"
    screen = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY") or ""
    if sys.platform == "linux" and not screen:
        return f"expected a display to open a window on, found none: set DISPLAY or WAYLAND_DISPLAY, or {instead}"
    if why := lacking("pygame"):
        return f"{why}; or {instead}"
    try:
        from vrg.ui.window.window import display_available  # without a screen the window library is not loaded
    except ImportError as error:
        return f"pygame, which draws windows, cannot be imported: {error}: install it again, or {instead}"
    return None if display_available() else f"no screen answers{screen and f' at {screen}'}: {instead}"


def need_display() -> None:
    """Make sure that a window can be opened.

    Raises:
        LaunchError: it cannot.
    """
    if why := no_window():
        raise LaunchError(why)


def web_address(typed: str | None) -> tuple[str, int | None]:
    """The address and the port at which something is served; None for a port that was not typed.

    Args:
        typed: such as `0.0.0.0:8080`, `192.168.1.5` or `[::1]:8080`; None for this machine only.

    Raises:
        typer.BadParameter: it is none of these.
    """
    from vrg.ui.web.admission import DEFAULT_HOST

    if typed is None:
        return DEFAULT_HOST, None
    host, colon, port = typed.rpartition(":") if typed.count(":") == 1 or "]:" in typed else (typed, "", "")
    if not host.strip("[]") or (colon and not (port.isdecimal() and 0 < int(port) < 65536)):
        raise typer.BadParameter(f"expected an address such as 0.0.0.0:8080, got {typed!r}", param_hint="--listen")
    return host.strip("[]"), int(port) if colon else None


def port_at(host: str, typed: int | None, usual: int, what: str) -> int:
    """The port at which something is served: the one that was typed, or else the usual one, or the next free.

    Raises:
        LaunchError: it is not free, or this machine has no such address.
    """
    from vrg.launch.endpoints import free_port  # few commands serve something

    try:
        return free_port(host, usual) if typed is None else free_port(host, typed, tries=1)
    except OSError as error:
        raise LaunchError(f"{what} cannot be served: {error}") from error


def listening_address(typed: str | None, usual: int, what: str) -> str:
    """The address and a free port, as `HOST:PORT`; see `web_address` and `port_at`."""
    host, port = web_address(typed)
    found = port_at(host, port, usual, what)
    return netloc(host, found)


def write_text(file: Path, text: str | bytes, *, named: bool = True) -> None:
    """Write a file. One that was there is replaced in one step.

    Args:
        named: whether a person has named it. A link of that name then stays, and leads to the new file; in the place of
            any other name, who has put it there is not known.

    Raises:
        ConfigError: it cannot be written; what was there still is.
    """
    data = text.encode() if isinstance(text, str) else text
    try:
        if named and file.exists() and not file.is_file():
            file.write_bytes(data)  # such as /dev/stdout
        else:
            write_whole(file.resolve() if named else file, data)
    except OSError as error:
        raise ConfigError(f"{file}: cannot be written: {error.strerror}: choose another place") from None
