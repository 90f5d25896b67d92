"""A match that has been checked: everything that its processes are made from, as plain data.

It is light: a process that is given a set-up needs neither the match file nor the code that checks one.
"""

from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct, structs

from vrg.bus.topics import Keys
from vrg.errors import ConfigError, LaunchError
from vrg.hal.companions import Companion
from vrg.hal.sim.config import RobotSetup, WorldConfig
from vrg.types import Pose


class PlayerSetup(Struct, frozen=True, kw_only=True):
    """One player.

    Args:
        role: at the start. team: of that role.
        model: of its robot. backend: what drives its robot.
        physical: its robot is a physical one. localisation: `odometry` or `feed`, see `vrg.hal.device.Device`.
        strategy: `module:Class` or `file.py:Class`.
        number: its place in the match file, from 0.
    """

    name: str
    role: str
    team: str
    model: str
    backend: str
    physical: bool
    localisation: str
    pose: Pose
    strategy: str
    number: int


class MatchSetup(Struct, frozen=True, kw_only=True):
    """A match.

    Args:
        text: of the match file, with the overrides. origin: its path, for messages.
        base: folder that its relative paths start from.
        map: a map's name, or the path of its file.
        rate: match seconds per real second; 1 with any physical robot, whatever the file says.
        wanted_rate: as the file says.
        rules: the game's own settings. backends: settings of those backends that take any, by name.
        companions: processes that the players' robots need besides the players' own.
    """

    text: str
    origin: str
    base: str
    name: str
    game: str
    map: str
    engine: str
    seed: int
    rate: float
    wanted_rate: float
    lasers: bool
    noise: bool
    rules: dict[str, Any]
    backends: dict[str, dict[str, Any]]
    players: list[PlayerSetup]
    companions: list[Companion]

    @property
    def keys(self) -> Keys:
        """The key map of this match."""
        return Keys(self.name)

    @property
    def physical(self) -> list[str]:
        """The players whose robots are physical ones."""
        return [p.name for p in self.players if p.physical]

    @property
    def world(self) -> WorldConfig:
        """What the world is made from."""
        robots = (RobotSetup(name=p.name, model=p.model, pose=p.pose, physical=p.physical) for p in self.players)
        return WorldConfig(
            map=self.map,
            engine=self.engine,
            seed=self.seed,
            rate=self.rate,
            lasers=self.lasers,
            noise=self.noise,
            robots=tuple(robots),
        )

    def player(self, name: str) -> PlayerSetup:
        """The player of this name.

        Raises:
            ConfigError: there is none.
        """
        for player in self.players:
            if player.name == name:
                return player
        known = ", ".join(p.name for p in self.players)
        raise ConfigError([f"expected the name of a player of this match ({known}), got {name!r}"])

    def at_rate(self, rate: float) -> "MatchSetup":
        """The same match at another rate; 0 = as fast as the processor allows."""
        return structs.replace(self, rate=rate)


def write_setup(setup: MatchSetup, path: Path) -> None:
    """Write a set-up for the processes of a match.

    Raises:
        LaunchError: the file cannot be written.
    """
    try:
        path.write_bytes(msgspec.json.encode(setup))
    except OSError as error:
        raise LaunchError(f"{path}: cannot be written: {error.strerror}: choose another place") from error


def read_setup(path: Path) -> MatchSetup:
    """Read a set-up that `write_setup` wrote.

    Raises:
        LaunchError: it cannot be read, or is of another release of VRG.
    """
    try:
        return msgspec.json.decode(path.read_bytes(), type=MatchSetup)
    except (OSError, msgspec.DecodeError) as error:
        raise LaunchError(f"{path}: expected the set-up of a match of this release: {error}") from None
