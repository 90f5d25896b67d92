"""`python -m vrg_games.micromouse FILE|SEED` writes a maze as a map."""

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from vrg.errors import ConfigError, FileError
from vrg.files import read_text
from vrg_games.micromouse.maze import from_maz, from_text, generated


def maze(
    what: Annotated[str, typer.Argument(metavar="FILE|SEED", help="A maze file, or the seed of a new maze.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder to write into.")] = Path(),
) -> None:
    """Print a maze, and write it as a map. FILE is a .maz file, or text with `o---o` posts.

    A match file beside the map plays in it with the line `map = "NAME.toml"`.

    Raises:
        ConfigError: FILE cannot be read, or is none of a maze.
    """
    path = Path(f"maze-{what}" if what.isdecimal() else what)
    try:
        if what.isdecimal():
            found = generated(np.random.default_rng(int(what)))
        else:
            found = from_maz(path.read_bytes()) if path.suffix.lower() == ".maz" else from_text(read_text(path))
        file = output / f"{path.stem}.toml"
        file.write_text(found.toml, encoding="utf-8")
    except (OSError, FileError) as error:
        raise ConfigError(str(error)) from None
    typer.echo(f"{found.text}\n{found.steps} steps to the middle; written to {file}")


if __name__ == "__main__":
    try:
        typer.run(maze)
    except ConfigError as error:
        sys.exit(f"maze: {error}")
