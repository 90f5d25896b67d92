"""The command `vrg run export`, which writes what players of recorded runs saw and did as a table to learn from."""

from collections.abc import Callable, Iterator, Sized
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from vrg.commands.matches import ended_run, need_recording
from vrg.errors import ConfigError, LaunchError, MessageError

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.recording.recorded import RecordedMatch
    from vrg.runs.run_folder import RunFolder
    from vrg_learn.lerobot import RecordedEpisode

T = TypeVar("T", bound=Sized)


def export(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[RUN ...]", help="Run folders, or names in the folder runs. Without any, the newest."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The file or folder to write; pairs.parquet, or lerobot.")
    ] = None,
    lerobot: Annotated[
        bool, typer.Option("--lerobot", help="Write a data set of LeRobot: an episode for each player and round.")
    ] = False,
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite the file if it exists.")] = False,
) -> None:
    """Write what each player saw and did at each decision of these runs, for programs that learn.

    A row is one decision: the run, the time, the player with its role and strategy, the observation and the action; in
    a data set of LeRobot also the reward.
    """
    from vrg_learn.lerobot import write as write_lerobot
    from vrg_learn.table import Heading, write

    output = output or Path("lerobot" if lerobot else "pairs.parquet")
    if output.is_file() and not replace:
        raise ConfigError(f"{output}: exists already: name another file with --output, or overwrite it with --replace")
    found = [_of(run) for run in runs] if runs else [_of(None)]
    _check_names([folder for folder, _ in found])
    headings = []
    for folder, setup in found:
        try:
            headings.append(heading := Heading.of(setup))
        except ConfigError as error:
            raise ConfigError(f"{folder.path}: {error}") from None
        if heading != headings[0]:
            first = found[0][0]
            raise ConfigError(
                f"{folder.path}: expected a run like {first.path}, {_kind(headings[0])}, got {_kind(heading)}: "
                "export them separately"
            )
    if lerobot:
        episodes, count = write_lerobot(output, headings[0], found[0][1].players[0].model, _episodes(found))
        typer.echo(f"Written to {output}: {episodes} episodes with {count} decisions.")
        return
    count = write(output, headings[0], _tables(found, headings[0]))
    typer.echo(f"Written to {output}: {count} decisions of {len(found)} {'run' if len(found) == 1 else 'runs'}.")


def _of(run: Path | None) -> "tuple[RunFolder, MatchSetup]":
    """A run folder with a recording, and the set-up of its match with the secret that it was played with.

    Raises:
        LaunchError: it has none, or its match runs.
    """
    folder, setup = ended_run(run)
    need_recording(folder)
    return folder, setup.with_secret(folder.secret()) if folder.secret_file.is_file() else setup


def _check_names(folders: "list[RunFolder]") -> None:
    """Make sure that the name of a folder tells one run from all others.

    Raises:
        ConfigError: it does not.
    """
    known: dict[str, Path] = {}
    for path in (folder.path for folder in folders):
        whole = path.resolve()
        if whole == known.get(whole.name):
            raise ConfigError(f"{path}: expected each run once, got this one twice: name it once")
        if whole.name in known:
            raise ConfigError(
                f"{path}: expected folders of different names, by which the table distinguishes runs, but also got "
                f"{known[whole.name]}: rename one of them"
            )
        known[whole.name] = whole


def _kind(heading: Any) -> str:
    return f"{heading.game} with {len(heading.observation)} values and actions of {len(heading.action)}"


def _tables(found: "list[tuple[RunFolder, MatchSetup]]", heading: Any) -> Iterator[Any]:
    """The rows of each run; see `_read`."""
    from vrg_learn.table import rows

    return _read(found, lambda setup, name, recorded: rows(heading, setup, name, recorded), "decisions")


def _episodes(found: "list[tuple[RunFolder, MatchSetup]]") -> "Iterator[list[RecordedEpisode]]":
    """The episodes of each run; see `_read`."""
    from vrg_learn.lerobot import episodes

    return _read(found, lambda setup, name, recorded: list(episodes(setup, name, recorded)), "episodes")


def _read(
    found: "list[tuple[RunFolder, MatchSetup]]", make: "Callable[[MatchSetup, str, RecordedMatch], T]", what: str
) -> "Iterator[T]":
    """What is made of each recording, with a bar on a terminal and a line for each run.

    Args:
        what: the word for the things that are made.

    Raises:
        LaunchError: a recording cannot be read, or lacks what is needed.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from vrg.recording.recorded import read_recorded

    console = Console(stderr=True, highlight=False, emoji=False)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("runs", total=len(found))
        for folder, setup in found:
            name = folder.path.resolve().name
            bar.update(task, description=name)
            try:
                recorded = read_recorded(folder.recordings())
            except (OSError, MessageError) as error:
                raise LaunchError(f"{folder.path}: its recording cannot be read: {error}") from None
            if not recorded.commands:
                raise LaunchError(f"{folder.path}: expected a recording with the commands of players, found none in it")
            made = make(setup, name, recorded)
            torn = "".join(f"; {part.name} ends in the middle" for part in recorded.torn)
            console.print(f"{name}: {len(made)} {what}{torn}", soft_wrap=True)
            bar.advance(task)
            yield made
