"""What the commands share that attach a window to a running match."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from vrg.commands.options import which_match
from vrg.config.setup import MatchSetup, read_setup
from vrg.errors import ConfigError, LaunchError
from vrg.regions import Region

SetupArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="[GAME|match.toml]",
        help="The match file, for the map's walls and the robots' sizes, if the match runs elsewhere.",
    ),
]


@dataclass(frozen=True)
class Attached:
    """A running match.

    Args:
        name: its name. endpoint: of its router.
        setup: its set-up; None if nobody on this machine knows it.
        run: its run folder; None if that is not on this machine.
    """

    name: str
    endpoint: str
    setup: MatchSetup | None = None
    run: Path | None = None

    @property
    def sizes(self) -> Mapping[str, tuple[float, float]]:
        """The length and width of the robots, m, by name."""
        return {} if self.setup is None else {player.name: player.robot.size for player in self.setup.players}

    @property
    def obstacles(self) -> Sequence[Region]:
        """The ground that the map's walls and obstacles cover, m."""
        return () if self.setup is None else self.setup.obstacles

    def known_setup(self, command: str) -> MatchSetup:
        """Its set-up.

        Args:
            command: what can be typed to name the match file, for the message.

        Raises:
            ConfigError: nobody here knows it.
        """
        if self.setup is None:
            raise ConfigError([f"{self.name} runs on another machine: name its match file too, as in `{command}`"])
        return self.setup


def attached(match: str | None, name: str | None, router: str | None) -> Attached:
    """The running match that is meant. One that runs on this machine has left its set-up in its run folder.

    Args:
        match: its match file, if that was typed. name: its name. router: the endpoint of its router.

    Raises:
        ConfigError: it is not clear which match is meant.
    """
    from vrg.launch import running
    from vrg.launch.run_folder import RunFolder

    setup = None
    if match is not None:
        from vrg.config.loading import load_match, match_path

        setup = load_match(match_path(match))
        if name not in (None, setup.name):
            raise ConfigError([f"{match}: expected the match file of {name!r}, got that of {setup.name!r}"])
        name = setup.name
    found, endpoint = which_match(name, router)
    here = next((m for m in running.running() if (m.match, m.router) == (found, endpoint)), None)
    if here is None:
        return Attached(found, endpoint, setup)
    run = RunFolder(Path(here.run))
    try:
        return Attached(found, endpoint, setup or read_setup(run.setup), run.path)
    except LaunchError:
        return Attached(found, endpoint)
