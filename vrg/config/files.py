"""The tables of a match file as people write them. Pydantic is loaded only where they are checked, in `loading`."""

import math
import re
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal, get_type_hints

from msgspec import Struct, field, structs

from vrg.games import GAMES
from vrg.geometry import compose
from vrg.hal.backends import BACKENDS
from vrg.hal.models import MODELS
from vrg.hal.sim.config import BodySetup
from vrg.hosts import check_host
from vrg.kinds import BY_PROCESS, COORDINATOR, RECORDER, ROUTER, SPECTATOR, WORLD
from vrg.names import NAME_RULE, is_name, normal
from vrg.radio_settings import LinkSettings, RadioSettings
from vrg.regions import Polygon
from vrg.segments import turned
from vrg.types import Pose, Vector

HERE = "here"
"""The name of the machine where the match is launched."""
PLACED = tuple(kind.process for kind in (ROUTER, WORLD, COORDINATOR, RECORDER, SPECTATOR))
"""The names of the processes of every match, which may be placed. Other views run where the match is launched."""
BODIES_LIMIT = 80
"""The most passive bodies of a match: they and the game's own things have room in a message."""
SMALLEST_EDGE = 0.001
"""The length of the shortest edge of a body, m."""
RESERVED = ("router-", "host-", "drives-")
"""The beginnings of the names of further processes and logs, in a match that spans several machines."""


class Constraint:
    """A constraint of a value besides its type, as metadata of the type.

    Args:
        check: returns the value, perhaps in another form, or raises a ValueError.
        bounds: what pydantic knows by name, such as `ge` and `max_length`.
    """

    def __init__(self, check: Callable[[Any], object] | None = None, **bounds: float | str) -> None:
        self._check, self._bounds = check, bounds

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema  # noqa: PLC0415 - only who checks a file needs it

        schema = {**handler(source), **self._bounds}
        return schema if self._check is None else core_schema.no_info_after_validator_function(self._check, schema)


class FileTable(Struct, frozen=True, kw_only=True):
    """The base class of the tables. Pydantic refuses unknown fields, NaN and infinity in them."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema  # noqa: PLC0415 - only who checks a file needs it

        hints = get_type_hints(cls, include_extras=True)
        fields = {
            field.name: core_schema.typed_dict_field(
                handler.generate_schema(hints[field.name]), required=field.required
            )
            for field in structs.fields(cls)
        }
        table = core_schema.typed_dict_schema(
            fields, extra_behavior="forbid", config=core_schema.CoreConfig(allow_inf_nan=False)
        )
        return core_schema.no_info_after_validator_function(lambda checked: cls(**checked), table)


def _name(value: str) -> str:
    value = normal(value)
    if not is_name(value):
        raise ValueError(NAME_RULE)
    return value


def _player_name(value: str) -> str:
    if value in BY_PROCESS or value == "drives" or value.startswith(RESERVED):
        raise ValueError(f"{value!r} is the name of another process of a match")
    return _name(value)


def _machine_names(value: dict[str, Any]) -> dict[str, Any]:
    for name in value:
        if not is_name(name):
            raise ValueError(f"{NAME_RULE}, got {name!r}")
    return value


def _engine(value: str) -> str:
    from vrg.hal.sim.engines import ENGINES  # noqa: PLC0415 - they load numpy, and players need none

    return ENGINES.known(value)


def _default_engine() -> str:
    from vrg.hal.sim.engines import default_engine  # noqa: PLC0415 - as above

    return default_engine()


def _convex(value: tuple[Vector, ...]) -> tuple[Vector, ...]:
    edges = zip(value, turned(value), strict=True)
    if len(value) < 3 or any(math.dist(a, b) < SMALLEST_EDGE for a, b in edges):
        raise ValueError(f"expected three corners or more, {SMALLEST_EDGE:g} m apart")
    Polygon(value)  # raises a ValueError
    return value


def _word(pattern: str, expected: str) -> Constraint:
    """The rule of a text that becomes a word of a command line."""

    def check(value: str) -> str:
        if not re.fullmatch(pattern, value):
            raise ValueError(f"expected {expected}, got {value!r}")
        return value

    return Constraint(check)


_Name = Annotated[str, Constraint(_name)]
_Share = Annotated[float, Constraint(ge=0, le=1)]
_Delay = Annotated[float, Constraint(ge=0, le=60)]
_Distance = Annotated[float, Constraint(gt=0, le=1e5)]
_Size = Annotated[float, Constraint(ge=0.001, le=100)]
_Coordinate = Annotated[float, Constraint(ge=-100, le=100)]


class PlayerEntry(FileTable, frozen=True, kw_only=True):
    """One [[players]] table of a match file.

    Args:
        name: the player's name.
        role: its role at the start. model: the model of its robot. backend: the backend that drives its robot.
        x, y: its place at the start, m. heading: its heading there, degrees counter-clockwise from +x.
        strategy: `module:Class` or `file.py:Class` of a strategy, or the name of one that a package has registered. The
            default is the game's own.
        localisation: how the robot is located: `odometry` if a physical robot measures its pose itself; `feed` if
            another program publishes it, for example a motion-capture system; `fusion` if the fusion centre estimates
            it from odometry and fixes, as of a camera. A virtual robot may have `fusion`; without it, it measures its
            pose well.
        sensors: the numbers of its robot's own sensors, in place of those of the match; see `MatchFile`.
        motion: the numbers of how its robot moves that are not those of its model: `v_max`, `w_max`, `a_max`,
            `slowing`, `brake`, `delay` and the effective `track`, as `vrg run report` finds them.
        camera: True lets the world take pictures of the robot's camera, for `readings.latest(Camera)`. They cost much
            time.
        machine: the machine on which its process runs: `here`, where the match is launched, or one of `machines`.
    """

    name: Annotated[str, Constraint(_player_name)]
    role: str
    model: Annotated[str, Constraint(MODELS.known)] = "P2AT"
    backend: Annotated[str, Constraint(BACKENDS.known)] = "sim"
    x: Annotated[float, Constraint(ge=-1e5, le=1e5)]
    y: Annotated[float, Constraint(ge=-1e5, le=1e5)]
    heading: Annotated[float, Constraint(ge=-1e4, le=1e4)] = 0.0
    strategy: str | None = None
    localisation: Literal["odometry", "feed", "fusion"] = "odometry"
    sensors: dict[str, dict[str, Any]] = {}
    motion: dict[str, Any] = {}
    camera: bool = False
    machine: str = HERE

    @property
    def pose(self) -> Pose:
        """The player's pose at the start, in m and rad."""
        return Pose(self.x, self.y, math.radians(self.heading))


class BodyEntry(FileTable, frozen=True, kw_only=True):
    """One [[bodies]] table of a match file: a passive body, such as a ball. It has a radius, a size or corners.

    Args:
        name: its name. kind: what it is, such as `ball`; the game knows by it what to do with it.
        x, y: its place at the start, m. heading: its heading there, degrees counter-clockwise from +x.
        radius: of a disc, which rolls, m. size: the length and width of a box, which slides, m.
        corners: of a convex outline, counter-clockwise, in its own frame, m. It turns about its centre of mass.
        mass: kg. height: m; a range finder that is higher does not see it.
        friction: the floor slows it by this times gravity, as it rolls or slides.
        restitution: the part of its speed with which it bounces, 0 to 1.
        localisation: `fusion` if it is a real one, which the fusion centre locates by fixes; without it, it is virtual.
    """

    name: Annotated[str, Constraint(_player_name)]
    kind: _Name
    x: Annotated[float, Constraint(ge=-1e5, le=1e5)]
    y: Annotated[float, Constraint(ge=-1e5, le=1e5)]
    heading: Annotated[float, Constraint(ge=-1e4, le=1e4)] = 0.0
    radius: _Size | None = None
    size: tuple[_Size, _Size] | None = None
    corners: Annotated[tuple[tuple[_Coordinate, _Coordinate], ...], Constraint(_convex)] | None = None
    mass: Annotated[float, Constraint(ge=0.001, le=1e4)] = 0.5
    height: _Size = 0.4
    friction: Annotated[float, Constraint(ge=0, le=10)] = 0.05
    restitution: _Share = 0.3
    localisation: Literal["fusion"] | None = None

    @property
    def setup(self) -> BodySetup:
        """The same for the world."""
        from vrg.hal.sim.contact import moments, rectangle  # noqa: PLC0415 - most matches have no bodies

        typed = Pose(self.x, self.y, math.radians(self.heading))
        corners = self.corners or (rectangle(*self.size).corners if self.size else ())
        x, y = moments(corners)[1] if corners else (0.0, 0.0)
        radius, about = 0.0 if corners else self.radius or 0.0, tuple((u - x, v - y) for u, v in corners)
        return BodySetup(
            name=self.name, kind=self.kind, pose=compose(typed, Pose(x, y, 0.0)), radius=radius, corners=about,
            mass=self.mass, height=self.height, friction=self.friction, restitution=self.restitution,
            tracked=self.localisation is not None,
        )  # fmt: skip


class TeamTable(FileTable, frozen=True, kw_only=True):
    """One [teams.NAME] table of a match file.

    Args:
        strategy: the strategy of each player of the team that names no other; see `Game.follows_team`.
    """

    strategy: str | None = None


class Machine(FileTable, frozen=True, kw_only=True):
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

    host: Annotated[
        str,
        _word(
            r"[A-Za-z0-9_]\S*",
            "what you type after `ssh`, such as robot@lab2.local; its port and other options belong in ~/.ssh/config",
        ),
    ] = ""
    address: Annotated[str, Constraint(check_host)] | None = None
    vrg: Annotated[
        str, _word(r"[A-Za-z0-9_./~+-]+", "the path of the command `vrg` there, such as ~/vrg/.venv/bin/vrg")
    ] = "vrg"
    display: Annotated[str, _word(r"[A-Za-z0-9_:./-]+", "a display there, such as :0")] | None = None
    router: bool = False
    via: str | None = None


class LinkTable(FileTable, frozen=True, kw_only=True):
    """The quality of the radio links between players; see `vrg.radio_settings.LinkSettings`.

    Args:
        range: the distance in m beyond which nothing arrives. loss: the share of messages that are lost, 0 to 1.
        delay: the time that each message takes at least, s. jitter: the longest additional time, s.
        bandwidth: the number of bytes that can travel in a second.
    """

    range: _Distance | None = None
    loss: _Share | None = None
    delay: _Delay | None = None
    jitter: _Delay | None = None
    bandwidth: Annotated[float, Constraint(gt=0, le=1e12)] | None = None

    @property
    def given(self) -> dict[str, float]:
        """The fields that the file has."""
        values = {name: getattr(self, name) for name in structs.asdict(LinkSettings())}
        return {name: value for name, value in values.items() if value is not None}


class PairTable(LinkTable, frozen=True, kw_only=True):
    """One [[radio.links]] table. Fields that it leaves out are as in the [radio] table.

    Args:
        between: the names of the two players. It holds for both directions.
    """

    between: tuple[_Name, _Name]


class RadioTable(LinkTable, frozen=True, kw_only=True):
    """The [radio] table of a match file: how all links are. Without it, every message arrives at once.

    Args:
        links: the links between two players that are not as all others.
    """

    links: list[PairTable] = []

    @property
    def settings(self) -> RadioSettings:
        """The same for the model of the radio."""
        every = LinkSettings(**self.given)
        links = {}
        for pair in self.links:
            one, other = pair.between
            links[f"{one}>{other}"] = links[f"{other}>{one}"] = structs.replace(every, **pair.given)
        return RadioSettings(every=every, links=links)


class MatchFile(FileTable, frozen=True, kw_only=True):
    """The top level of a match file.

    Args:
        name: the name of the match, which is a part of every key on the bus.
        game: the name of the game. map: a map's name, or the path of its file. engine: the physics engine's name.
        seed: the seed of all random numbers in the match.
        secret: makes the random numbers others than those of the seed alone, so that they cannot be worked out from it.
        rate: match seconds per real second.
        lasers: False omits all range finders, to save time where no player looks at them. noise: False means perfect
            sensors: no noise and no drop-outs, for any value of `sensors`; and no drift in the air.
        on_fault: what follows if a player fails for good, as its program fails too often, hangs, prints without end or
            uses too much memory: `disqualify` takes it out and plays on, `halt` halts the match.
        memory: the most memory that a player's process may use, MB.
        bank: in one process and in lockstep, the real time in s that a player's code may take in a match beyond the
            match time. Then it forfeits its decisions, and its robot stands.
        seats: True lets only processes with keys into the match, and each only as its seat may; see docs/seats.md. The
            default is True in a match that spans several machines, and False in others.
        sandbox: True seals the process in which each strategy decides before its code is loaded; see
            docs/players.md. The default is True for the strategies that are files (`file.py:Class`) of a match with
            seats, and False for others. It holds only where players have processes of their own.
        radio: how well players hear one another; without it, every message arrives at once.
        sight: how far a team sees, m: its players receive the poses only of those opponents that are so near to one of
            them. Without it, they receive all poses that the game publishes.
        teams: what holds for all players of a team, by the team's name, such as `[teams.red]`.
        rules: the game's own settings.
        sensors: numbers of the robots' sensors, in place of those of the robots' models. Each kind of sensor has a
            table, such as `[sensors.laser]`, with fields of its spec: `noise = 0.03`, `drop_out = 0.1`. It holds for
            every robot that has such a sensor. `[players.sensors.laser]` below a player holds for that player's robot
            alone. For a physical robot, only the sensors that the world simulates change.
        backends: the settings of the backends that have any, by name.
        localisation: the sources of fixes, by names of their own, each with its kind and settings:
            `[localisation.overhead]`, `source = "sim"`, `rate = 15.0`.
        machines: the further machines on which processes of the match run, by names of their own.
        place: the machines of the processes that are no players, by the process' name: `world = "lab2"`. What is
            missing runs `here`, where the match is launched; the companions of a robot run where its player runs.
        players: the players, at least one. bodies: the passive bodies, such as balls and boxes.
    """

    name: _Name
    game: Annotated[str, Constraint(GAMES.known)]
    map: str
    engine: Annotated[str, Constraint(_engine)] = field(default_factory=_default_engine)
    seed: Annotated[int, Constraint(ge=0)] = 0
    secret: Annotated[str, Constraint(max_length=64, pattern="^[!-~]*$")] = ""
    rate: Annotated[float, Constraint(ge=0.1, le=100)] = 1.0
    lasers: bool = True
    noise: bool = True
    on_fault: Literal["disqualify", "halt"] = "disqualify"
    memory: Annotated[int, Constraint(ge=200, le=1_000_000)] = 2000
    bank: Annotated[float, Constraint(gt=0, le=1e6)] = 60.0
    seats: bool | None = None
    sandbox: bool | None = None
    radio: RadioTable = RadioTable()
    sight: _Distance | None = None
    teams: dict[str, TeamTable] = {}
    rules: dict[str, Any]
    sensors: dict[str, dict[str, Any]] = {}
    backends: dict[str, dict[str, Any]] = {}
    localisation: dict[str, dict[str, Any]] = {}
    machines: Annotated[dict[str, Machine], Constraint(_machine_names)] = {}
    place: dict[str, str] = {}
    players: Sequence[PlayerEntry]
    bodies: Annotated[list[BodyEntry], Constraint(max_length=BODIES_LIMIT)] = []
