"""The command `vrg edit`, with which a person chooses and changes a match in a browser."""

import os
import signal
import subprocess
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from vrg.commands.options import RunsOption
from vrg.errors import ConfigError, LaunchError
from vrg.system import POSIX

if TYPE_CHECKING:
    from vrg_edit.draft import Draft

WebOption = Annotated[bool, typer.Option("--web", help="Also show the running match in the same page.")]
PORT: Final = 8079
"""The port of the page, below that of a match; if another program has it, the next one that is free."""
_LOOKS: Final = 0.2
"""The real time in s between two looks at what the page wants."""


def edit(
    match: Annotated[
        Path | None,
        typer.Argument(metavar="match.toml", help="The match file to change. Without one, the page offers games."),
    ] = None,
    runs: RunsOption = Path("runs"),
    web: WebOption = False,
) -> None:
    """Choose a game or a match in a browser, change it while its problems show beside the fields, save it and play it.

    If no browser can be opened, the page is still served, for a browser on another computer.
    """
    from vrg_edit.folder import open_draft

    draft = None if match is None else open_draft(match)
    if not has_browser() and not sys.stdin.isatty():
        raise ConfigError("vrg edit: expected a browser for its page, or a terminal for its link, found neither")
    begin(runs, draft, web=web)


def has_browser() -> bool:
    """True if a browser can be opened that shows the page."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    try:
        # One of the plain kind is waited for, such as those of the terminal, which run no scripts.
        return type(webbrowser.get()) is not webbrowser.GenericBrowser
    except webbrowser.Error:
        return False


def begin(runs: Path = Path("runs"), draft: "Draft | None" = None, *, web: bool = False) -> None:
    """Serve the page on which a person chooses and changes a match, until the person has decided, and do that.

    Args:
        runs: the folder of run folders. draft: the match file to change; None offers games and recent matches first.
        web: True shows the match in the page once it is played.
    """
    from vrg.launch.endpoints import free_port
    from vrg_edit.editor import Editor
    from vrg_edit.server import HOST, EditServer

    editor = Editor(Path.cwd(), runs, draft)
    while True:
        port = free_port(HOST, PORT)
        server = EditServer(editor, port)
        try:
            server.start()
            break
        except LaunchError:
            if free_port(HOST, PORT) == port:
                raise  # it is not that another page, begun at the same instant, was faster
    # The end of the terminal or of the session is an end like Ctrl-C: what is not saved is kept.
    for number in (signal.SIGTERM, *([signal.SIGHUP] if POSIX else [])):
        signal.signal(number, signal.default_int_handler)
    try:
        opened = has_browser() and webbrowser.open(server.ticket)
        if opened:  # a browser may refuse to start, and not tell
            typer.echo(f"your browser opens the page; if it does not: {server.link}")
        else:
            typer.echo(f"open this page in a browser: {server.link}")
        typer.echo("Ctrl-C ends it")
        outcome = None
        while outcome is None:
            outcome = server.wait(_LOOKS)
    finally:
        server.stop()
        if message := server.rescue():
            typer.echo(message, err=True)
    if outcome.play is not None:
        run(["play", outcome.play, *(["--listen", f"{HOST}:{port}"] if web else [])], runs)
    elif outcome.watch is not None:
        run(["run", "replay", str(outcome.watch)], runs)


def run(words: Sequence[str], runs: Path) -> None:
    """Go on as another command of `vrg`, in the same terminal and with nothing left of this one."""
    command = [*words, "--runs", str(runs)]
    typer.echo(f"vrg {' '.join(words)}")
    sys.stdout.flush()
    again = [sys.executable, "-P", "-m", "vrg", *command]
    if not POSIX:
        raise typer.Exit(subprocess.call(again))  # there the terminal would not wait for it
    os.execv(sys.executable, again)
