"""The configurator without a browser: questions in the terminal, with the same draft and the same check behind them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import typer

from vrg.bus.names import NAME_RULE, is_name
from vrg.commands.checking import DraftCheck
from vrg.commands.drafts import choices_in, save_draft, text_in
from vrg.errors import ConfigError, Problem
from vrg.errors import Path as Place
from vrg.games import GAMES, game_of
from vrg.ui.edit.checking import problem_text
from vrg.ui.edit.draft import COLUMNS, Draft
from vrg.ui.edit.placing import MOST, with_count

INTRODUCTION: Final = (
    "A few questions here make the match. ENTER takes what stands in brackets, ? lists what "
    "can be chosen, and Ctrl-C ends this."
)
ASKED: Final = ("map", "engine", "seed")
"""The fields of the match that are asked for."""


def ask(draft: Draft | None, folder: Path) -> Path | None:
    """Make or change a match by questions, and save it.

    Args:
        draft: the match file to change; None begins with the choice of a game. folder: for new matches.

    Returns:
        the file to play; None if the person only wanted to save.

    Raises:
        ConfigError: the file is no TOML.
        typer.Abort: the person has had enough, or the input has ended.
    """
    check, choices = DraftCheck(), choices_in(folder if draft is None else draft.base)
    typer.echo(INTRODUCTION)
    if draft is None:
        for name in GAMES.names():
            typer.echo(f"  {name.ljust(20)}{game_of(name).about}")
        draft = Draft.of_game(_one_of("game", GAMES.names(), "sharks-and-minnows"), folder)
    if not draft.data:
        raise ConfigError(check(draft).problems)
    for field in ASKED:
        draft = _field(draft, (field,), choices.of(draft, field), check)
    draft = _count(draft, check)
    while True:
        draft = _players(draft, choices.of, check)
        problems = check(draft).problems
        if not problems:
            break
        _tell(draft, problems)
        typer.echo("It cannot be played like this. Change the players that it names, or one of these fields:")
        for field in ASKED:
            draft = _field(draft, (field,), choices.of(draft, field), check)
    draft = _save(draft)
    typer.echo(f"wrote {draft.file}")
    return draft.file if typer.confirm("Play it now?", default=True) else None


def _one_of(what: str, names: Sequence[str], default: str) -> str:
    """Ask for one of these names until one of them is typed."""
    while True:
        typed: str = typer.prompt(what, default=default)
        if typed in names:
            return typed
        listed = ", ".join(names)
        typer.echo(f"  {listed}" if typed.strip() == "?" else f"  expected one of {listed}, got {typed!r}")


def _field(draft: Draft, path: Place, names: Sequence[str], check: DraftCheck, label: str = "") -> Draft:
    """Ask for a field until it has no problem of its own, or is left as it was."""
    while True:
        now = draft.shown(path) or draft.default(path)
        typed: str = typer.prompt(label or str(path[-1]), default=now, show_default=bool(now))
        if typed.strip() == "?":
            typer.echo(f"  {', '.join(name or '(default)' for name in names) or 'anything can be typed here'}")
            continue
        if typed == now:
            return draft
        try:
            changed = draft.set(path, typed)
        except ValueError as error:
            typer.echo(f"  only a text editor can change this: {error}")
            return draft
        before = set(check(draft).of(path))
        new = [problem for problem in check(changed).of(path) if problem not in before]
        if not new:
            return changed
        _tell(changed, new)


def _count(draft: Draft, check: DraftCheck) -> Draft:
    while True:
        typed: str = typer.prompt("number of players", default=str(len(draft.players)))
        if typed.isascii() and typed.isdigit() and 1 <= int(typed) <= MOST:
            return with_count(draft, int(typed), check(draft))
        typer.echo(f"  expected a whole number from 1 to {MOST}, got {typed!r}")


def _players(draft: Draft, choices: Callable[[Draft, str], Sequence[str]], check: DraftCheck) -> Draft:
    """Show the players, and let them be changed one by one until there is no more to change."""
    while True:
        _list(draft)
        typed: str = typer.prompt("change which player? (its number; ENTER for none)", default="", show_default=False)
        if not typed.strip():
            return draft
        if not (typed.isascii() and typed.isdigit() and 1 <= int(typed) <= len(draft.players)):
            typer.echo(f"  expected a number from 1 to {len(draft.players)}, got {typed!r}")
            continue
        player = int(typed) - 1
        for field in COLUMNS:
            label = {"x": "x in m", "y": "y in m", "heading": "heading in degrees"}.get(field, field)
            draft = _field(draft, ("players", player, field), choices(draft, field), check, f"  {label}")


def _list(draft: Draft) -> None:
    """Show the players as a table."""
    rows: list[tuple[str, ...]] = [("", *COLUMNS)]
    for number, _ in enumerate(draft.players):
        paths: list[Place] = [("players", number, field) for field in COLUMNS]
        fields = (draft.shown(path) or draft.default(path) or "(default)" for path in paths)
        rows.append((str(number + 1), *fields))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        typer.echo("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())


def _tell(draft: Draft, problems: Sequence[Problem]) -> None:
    for problem in problems:
        typer.echo(f"  {problem_text(problem, draft)}")


def _save(draft: Draft) -> Draft:
    """Ask for a name and write the file; another file is only replaced if the person wants that."""
    known = draft.text if draft.file is None else text_in(draft.file) or ""
    file = draft.file
    while True:
        name = typer.prompt("save as", default=file.stem if file is not None else draft.shown(("name",)))
        name = name.strip().removesuffix(".toml")
        if not is_name(name):
            typer.echo(f"  {NAME_RULE}, got {name!r}")
            continue
        named = draft if file is not None and name == file.stem else draft.named(name, draft.base / f"{name}.toml")
        assert named.file is not None
        try:
            save_draft(named, known if named.file == file else "")
        except FileExistsError:
            if not typer.confirm(f"  {named.file} is already there. Replace it?", default=False):
                continue
            save_draft(named, None)
        except OSError as error:
            typer.echo(f"  {named.file} cannot be written: {error.strerror}")
            continue
        return named
