"""The tables of a match file as people write them."""

import math
import re
from typing import Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from vrg.bus.hosts import check_host
from vrg.bus.names import NAME_RULE, is_name, normal
from vrg.bus.radio_settings import LinkSettings, RadioSettings
from vrg.config.setup import HERE
from vrg.games import GAMES, PLANNERS
from vrg.hal.backends import BACKENDS
from vrg.hal.models import MODELS
from vrg.hal.sim.engines import ENGINES
from vrg.tables import Table, known_in
from vrg.types import Pose

PLACED = ("router", "world", "referee", "recorder", "spectator")
"""The names of the processes of every match."""
PROCESS_NAMES = (*PLACED, "drives", "web", "foxglove")
"""The names of other processes. A player cannot have one of them, as its process and log are named after it."""
RESERVED = ("router-", "host-", "drives-")
"""What the names of further processes and logs begin with, in a match that spans several machines."""


def _check_name(value: str) -> str:
    value = normal(value)
    if not is_name(value):
        raise ValueError(NAME_RULE)
    return value


class PlayerEntry(Table):
    """One [[players]] table of a match file.

    Args:
        name: the player's name.
        role: its role at the start. model: the model of its robot. backend: the backend that drives its robot.
        x, y: its place at the start, m. heading: its heading there, degrees counter-clockwise from +x.
        strategy: `module:Class` or `file.py:Class` of a strategy, or the name of one that a package has registered. The
            default is the game's own.
        localisation: how a physical robot is located: `odometry` if it measures its pose itself; `feed` if another
            program publishes it, for example a motion-capture system.
        sensors: the numbers of its robot's own sensors, in place of those of the match; see `MatchFile`.
        camera: True lets the world take pictures of the robot's camera, for `readings.latest(Camera)`. They cost much
            time.
        machine: the machine on which its process runs: `here`, where the match is launched, or one of `machines`.
    """

    name: str
    role: str
    model: str = "P2AT"
    backend: str = "sim"
    x: float = Field(ge=-1e5, le=1e5)
    y: float = Field(ge=-1e5, le=1e5)
    heading: float = Field(0.0, ge=-1e4, le=1e4)
    strategy: str | None = None
    localisation: Literal["odometry", "feed"] = "odometry"
    sensors: dict[str, dict[str, Any]] = Field(default_factory=dict)
    camera: bool = False
    machine: str = HERE

    @field_validator("name")
    @classmethod
    def _name(cls, value: str) -> str:
        if value in PROCESS_NAMES or value.startswith(RESERVED):
            raise ValueError(f"{value!r} is the name of another process of a match")
        return _check_name(value)

    @field_validator("model")
    @classmethod
    def _model(cls, value: str) -> str:
        return known_in(value, MODELS)

    @field_validator("backend")
    @classmethod
    def _backend(cls, value: str) -> str:
        return known_in(value, BACKENDS)

    @property
    def pose(self) -> Pose:
        """The player's pose at the start, in m and rad."""
        return Pose(self.x, self.y, math.radians(self.heading))


class TeamTable(Table):
    """One [teams.NAME] table of a match file.

    Args:
        strategy: the strategy of each player of the team that names no other.
    """

    strategy: str | None = None


_WORDS = {
    "host": (
        re.compile(r"[A-Za-z0-9_][^\s]*"),
        "what you type after `ssh`, such as robot@lab2.local; its port and other options belong into ~/.ssh/config",
    ),
    "vrg": (re.compile(r"[A-Za-z0-9_./~+-]+"), "the path of the command `vrg` there, such as ~/vrg/.venv/bin/vrg"),
    "display": (re.compile(r"[A-Za-z0-9_:./-]+"), "a display there, such as :0"),
}
"""What the fields of a machine may hold, and how to say so: they become words of a command line."""


class MachineTable(Table):
    """One [machines.NAME] table of a match file.

    Args:
        host: what `ssh` connects to: a host of the user's ssh configuration, or `user@address`. The machine `here` has
            none.
        address: the address or name at which the other machines reach this one, if its router runs there. The default
            is the one that ssh has used.
        vrg: the command `vrg` on that machine. display: the display on that machine for windows, such as `:0`.
        router: True runs a further router there, which is linked to the router of the match. The machine's own
            processes use it.
        via: the machine whose further router the processes of this machine use.
    """

    host: str | None = None
    address: str | None = None
    vrg: str = "vrg"
    display: str | None = None
    router: bool = False
    via: str | None = None

    @field_validator("host", "vrg", "display")
    @classmethod
    def _word(cls, value: str | None, info: ValidationInfo) -> str | None:
        pattern, expected = _WORDS[info.field_name or ""]
        if value is not None and not pattern.fullmatch(value):
            raise ValueError(f"expected {expected}, got {value!r}")
        return value

    @field_validator("address")
    @classmethod
    def _address(cls, value: str | None) -> str | None:
        return None if value is None else check_host(value)


class LinkTable(Table):
    """How well messages travel between players; see `vrg.bus.radio_settings.LinkSettings`.

    Args:
        range: the distance in m beyond which nothing arrives. loss: the share of messages that are lost, 0 to 1.
        delay: the time that each message takes at least, s. jitter: the longest additional time, s.
        bandwidth: the number of bytes that can travel in a second.
    """

    range: float | None = Field(None, gt=0, le=1e5)
    loss: float = Field(0.0, ge=0, le=1)
    delay: float = Field(0.0, ge=0, le=60)
    jitter: float = Field(0.0, ge=0, le=60)
    bandwidth: float | None = Field(None, gt=0, le=1e12)


class PairTable(LinkTable):
    """One [[radio.links]] table. What it leaves out is as the [radio] table says.

    Args:
        between: the names of the two players. It holds for both directions.
    """

    between: tuple[str, str]

    @field_validator("between")
    @classmethod
    def _names(cls, value: tuple[str, str]) -> tuple[str, str]:
        return _check_name(value[0]), _check_name(value[1])


class RadioTable(LinkTable):
    """The [radio] table of a match file: how all links are. Without it, every message arrives at once.

    Args:
        links: the links between two players that are not as all others.
    """

    links: list[PairTable] = Field(default_factory=list)

    @property
    def settings(self) -> RadioSettings:
        """The same for the model of the radio."""
        fields = set(LinkTable.model_fields)
        every = self.model_dump(include=fields)
        links = {}
        for pair in self.links:
            link = LinkSettings(**{**every, **pair.model_dump(include=fields, exclude_unset=True)})
            one, other = pair.between
            links[f"{one}>{other}"] = links[f"{other}>{one}"] = link
        return RadioSettings(every=LinkSettings(**every), links=links)


class MatchFile(Table):
    """The top level of a match file.

    Args:
        name: the name of the match, which is a part of every key on the bus.
        game: the name of the game. map: a map's name, or the path of its file. engine: the physics engine's name.
        seed: the seed of all random numbers in the match.
        secret: makes the random numbers others than those of the seed alone, so that nobody can work them out from it.
        rate: match seconds per real second.
        lasers: False omits all range finders, to save time where no player looks at them. noise: False means perfect
            sensors: no noise and no drop-outs, whatever `sensors` says.
        planner: the name of a planner that an installed package has registered. It may change how all players drive.
        on_fault: what follows if a player fails for good, as its program fails too often, hangs, prints without end or
            uses too much memory: `disqualify` takes it out and plays on, `halt` halts the match.
        memory: the most memory that a player's process may use, MB.
        seats: True lets only processes with keys into the match, and each only as its seat may; see docs/seats.md. The
            default is True in a match that spans several machines, and False in others.
        sandbox: True seals the process of each player before its code is loaded, so that it can only play; see
            docs/players.md. The default is True for the strategies that are files (`file.py:Class`) of a match with
            seats, and False for others. It holds only where players have processes of their own.
        radio: how well players hear one another; without it, every message arrives at once.
        sight: how far a team sees, m: its players are told the poses only of those opponents that are so near to one of
            them. Without it, they are told all poses that the game publishes.
        teams: what holds for all players of a team, by the team's name, such as `[teams.red]`.
        rules: the game's own settings.
        sensors: numbers of the robots' sensors, in place of those of the robots' models. Each kind of sensor has a
            table, such as `[sensors.laser]`, with fields of its spec: `noise = 0.03`, `drop_out = 0.1`. It holds for
            every robot that has such a sensor. `[players.sensors.laser]` below a player holds for that player's robot
            alone. Of a physical robot, only the sensors that the world simulates change.
        backends: the settings of the backends that have any, by name.
        machines: the further machines on which processes of the match run, by names of their own.
        place: the machines of the processes that are no players, by the process' name: `world = "lab2"`. What is
            missing runs `here`, where the match is launched; the companions of a robot run where its player runs.
        players: the players, at least one.
    """

    name: str
    game: str
    map: str
    engine: str = "pybullet"
    seed: int = Field(0, ge=0)
    secret: str = Field("", max_length=64, pattern="^[!-~]*$")
    rate: float = Field(1.0, ge=0.1, le=100)
    lasers: bool = True
    noise: bool = True
    planner: str | None = None
    on_fault: Literal["disqualify", "halt"] = "disqualify"
    memory: int = Field(2000, ge=200, le=1_000_000)
    seats: bool | None = None
    sandbox: bool | None = None
    radio: RadioTable | None = None
    sight: float | None = Field(None, gt=0, le=1e5)
    teams: dict[str, TeamTable] = Field(default_factory=dict)
    rules: dict[str, Any]
    sensors: dict[str, dict[str, Any]] = Field(default_factory=dict)
    backends: dict[str, dict[str, Any]] = Field(default_factory=dict)
    machines: dict[str, MachineTable] = Field(default_factory=dict)
    place: dict[str, str] = Field(default_factory=dict)
    players: list[PlayerEntry] = Field(min_length=1)

    @field_validator("name")
    @classmethod
    def _name(cls, value: str) -> str:
        return _check_name(value)

    @field_validator("machines")
    @classmethod
    def _machines(cls, value: dict[str, MachineTable]) -> dict[str, MachineTable]:
        for name in value:
            if not is_name(name):
                raise ValueError(f"{NAME_RULE}, got {name!r}")
        return value

    @field_validator("game")
    @classmethod
    def _game(cls, value: str) -> str:
        return known_in(value, GAMES)

    @field_validator("planner")
    @classmethod
    def _planner(cls, value: str | None) -> str | None:
        return value if value is None else known_in(value, PLANNERS)

    @field_validator("engine")
    @classmethod
    def _engine(cls, value: str) -> str:
        return known_in(value, ENGINES)
