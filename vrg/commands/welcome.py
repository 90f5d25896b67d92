"""Plain `vrg`, which opens the welcome window or asks in the terminal, and `vrg edit`, which changes a match file."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vrg.commands.options import RunsOption, has_display
from vrg.errors import ConfigError

if TYPE_CHECKING:
    from vrg.ui.welcome.draft import Draft
    from vrg.ui.welcome.window import Outcome, Tools


def edit(
    match: Annotated[Path, typer.Argument(metavar="match.toml", help="The match file to change.")],
    runs: RunsOption = Path("runs"),
) -> None:
    """Change a match file in a window, with its problems beside its fields; save it, and play it.

    Without a display, the terminal asks for the same.
    """
    from vrg.commands.drafts import open_draft

    draft = open_draft(match)
    if not has_display() and not sys.stdin.isatty():
        raise ConfigError([f"{match}: expected a display or a terminal to change it at, found neither"])
    begin(runs, draft)


def welcome() -> None:
    """Choose a game or a recent match, change it, and play it."""
    begin()


def begin(runs: Path = Path("runs"), draft: "Draft | None" = None) -> None:
    """Let a person choose and change a match, at a window or else in the terminal, and do what the person wants.

    Args:
        runs: the folder of run folders. draft: the match file to change; None offers games and recent matches first.

    Raises:
        typer.Exit: with status 130, if the person has ended the questions by Ctrl-C.
    """
    if has_display():
        from vrg.ui.welcome.window import WelcomeWindow, show

        follow(show(WelcomeWindow(tools(runs), Path.cwd(), draft)), runs)
        return
    from vrg.commands.prompt import ask

    try:
        played = ask(draft, Path.cwd())
    except typer.Abort:
        typer.echo()
        raise typer.Exit(130) from None
    if played is not None:
        run(["play", str(played)], runs)


def tools(runs: Path) -> "Tools":
    """What the window needs of the rest of VRG."""
    from vrg.commands.checking import DraftCheck
    from vrg.commands.drafts import choices_in, recent_matches, save_draft
    from vrg.ui.welcome.window import Tools

    return Tools(
        check=DraftCheck(),
        places=DraftCheck(imports=False),
        save=save_draft,
        choices=choices_in(Path.cwd()),
        recent=lambda: recent_matches(runs, Path.cwd()),
    )


def follow(outcome: "Outcome", runs: Path) -> None:
    """Do what the person wants, now that the window is closed."""
    if outcome.play is not None:
        run(["play", outcome.play], runs)
    elif outcome.watch is not None:
        run(["run", "replay", str(outcome.watch)], runs)


def run(words: Sequence[str], runs: Path) -> None:
    """Go on as another command of `vrg`, in the same terminal and with nothing left of this one."""
    command = [*words, "--runs", str(runs)]
    typer.echo(f"vrg {' '.join(words)}")
    sys.stdout.flush()
    os.execv(sys.executable, [sys.executable, "-P", "-m", "vrg", *command])
