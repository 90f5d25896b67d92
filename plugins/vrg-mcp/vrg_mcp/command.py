"""`vrg mcp`."""

from pathlib import Path
from typing import Annotated

import typer

from vrg.errors import ConfigError
from vrg.launch.sandbox.seal import missing


def mcp(
    folder: Annotated[
        Path, typer.Argument(metavar="[FOLDER]", help="The folder of the players and runs; it is made if missing.")
    ] = Path("players"),
    match: Annotated[
        list[Path] | None,
        typer.Option(help="A match file that may be played besides those of the games; its robots are simulated."),
    ] = None,
    official: Annotated[
        bool, typer.Option("--official", help="Add tools that halt, resume and end the match that runs here.")
    ] = False,
) -> None:
    """Serve VRG to a coding agent on the standard input and output, by the Model Context Protocol.

    The agent writes players into FOLDER, lets them play, always sealed and in simulation, and looks at the runs. It
    names games, strategies and files of FOLDER, and never a path.
    """
    from vrg_mcp.knowledge import matches
    from vrg_mcp.players import PlayerFolder
    from vrg_mcp.server import server_of

    if (lacking := missing()) is not None:
        raise ConfigError(f"{lacking}: what an agent writes is played only in a sandbox")
    # No shell has read what stands in the settings of a client.
    players, files = PlayerFolder(_whole(folder)), [_whole(file) for file in match or []]
    server_of(players, matches(files), official=official).run("stdio")


def _whole(path: Path) -> Path:
    """A path with a home folder in place of `~`.

    Raises:
        ConfigError: nobody has this name.
    """
    try:
        return path.expanduser()
    except RuntimeError:
        raise ConfigError(f"{path}: expected a path, found no home folder for {path.parts[0]}: write it out") from None
