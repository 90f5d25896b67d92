"""Match files: one TOML file describes a match, and everything wrong with it is said at once."""

import math
import re
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, ValidationError, field_validator

from vrg.agents.importing import import_object
from vrg.agents.players import default_strategy
from vrg.agents.strategy import Strategy
from vrg.bus.messages import Pose
from vrg.bus.topics import NAME_PATTERN, Keys
from vrg.coordinator.games import GAMES, make_rulebook
from vrg.coordinator.rulebook import Contestant, RuleBook
from vrg.errors import ConfigError
from vrg.hal.backends import backend_names, settings_type
from vrg.hal.models import MODELS, robot_model
from vrg.hal.settings import Companion
from vrg.hal.sim.config import RobotSetup, WorldConfig, check_setup
from vrg.hal.sim.map import load_map
from vrg.tables import Table, one_of
from vrg.toml_text import line_of, lines_of, syntax_error_line, with_values

PROCESS_NAMES = ("router", "world", "referee", "recorder", "spectator", "drives")
"""A player's process and log are named after the player; these names are taken."""


def _check_name(value: str) -> str:
    if not NAME_PATTERN.fullmatch(value):
        raise ValueError("expected 1 to 64 of A-Z a-z 0-9 _ - beginning with a letter or digit")
    return value


class PlayerEntry(Table):
    """One [[players]] table.

    Args:
        role: at the start. model: of its robot. backend: what its robot is.
        x, y: m. heading: degrees counter-clockwise from +x.
        strategy: `module:Class` or `file.py:Class` of a player of one's own; the game's own if missing.
    """

    name: str
    role: str
    model: str = "P2AT"
    backend: str = "sim"
    x: float
    y: float
    heading: float = 0.0
    strategy: str | None = None

    @field_validator("name")
    @classmethod
    def _name(cls, value: str) -> str:
        if value in PROCESS_NAMES:
            raise ValueError(f"{value!r} is the name of another process of a match")
        return _check_name(value)

    @field_validator("model")
    @classmethod
    def _model(cls, value: str) -> str:
        return one_of(value, sorted(MODELS))

    @field_validator("backend")
    @classmethod
    def _backend(cls, value: str) -> str:
        return one_of(value, backend_names())

    @property
    def physical(self) -> bool:
        """Whether its robot is no virtual one."""
        return self.backend != "sim"

    @property
    def pose(self) -> Pose:
        """Its place at the start."""
        return Pose(self.x, self.y, math.radians(self.heading))


class MatchFile(Table):
    """A match file as it is written.

    Args:
        name: of the match: part of every key on the bus.
        seed: of every random number in the match.
        rate: match seconds per real second.
        lasers: False saves the scans where no player looks at them. noise: False = perfect sensors.
        rules: the game's own settings.
        backends: settings of those backends that take any, by name.
    """

    name: str
    game: str
    map: str
    engine: str = "pybullet"
    seed: int = Field(0, ge=0)
    rate: float = Field(1.0, ge=0.1, le=100)
    lasers: bool = True
    noise: bool = True
    rules: dict[str, Any]
    backends: dict[str, dict[str, Any]] = Field(default_factory=dict)
    players: list[PlayerEntry] = Field(min_length=1)

    @field_validator("name")
    @classmethod
    def _name(cls, value: str) -> str:
        return _check_name(value)

    @field_validator("game")
    @classmethod
    def _game(cls, value: str) -> str:
        return one_of(value, sorted(GAMES))


@dataclass(frozen=True)
class MatchSetup:
    """A match that has been checked: everything that its processes are made from.

    Args:
        text: of the match file, with the overrides. base: folder that its relative paths start from.
    """

    file: MatchFile
    text: str
    base: Path
    settings: BaseModel
    world: WorldConfig

    @property
    def keys(self) -> Keys:
        """The key map of this match."""
        return Keys(self.file.name)

    @property
    def physical(self) -> list[str]:
        """The players whose robots are no virtual ones. With any of them the world keeps real time, whatever `rate`."""
        return [p.name for p in self.file.players if p.physical]

    @property
    def companions(self) -> list[Companion]:
        """The processes that the players' robots need besides the players' own."""
        found: list[Companion] = []
        for backend in dict.fromkeys(p.backend for p in self.file.players):
            kind = settings_type(backend)
            if kind is not None:
                robots = [p.name for p in self.file.players if p.backend == backend]
                found += kind.model_validate(self.file.backends[backend]).companions(robots)
        return found

    def player(self, name: str) -> PlayerEntry:
        """The player of this name.

        Raises:
            ConfigError: there is none.
        """
        for player in self.file.players:
            if player.name == name:
                return player
        known = ", ".join(p.name for p in self.file.players)
        raise ConfigError([f"expected the name of a player of this match ({known}), got {name!r}"])

    def rulebook(self) -> RuleBook[Any]:
        """A fresh rule book."""
        return make_rulebook(self.file.game, self.settings, _contestants(self.file))

    def strategy(self, name: str) -> Strategy:
        """The strategy of a player, imported now.

        Raises:
            ConfigError: it cannot be imported, or is no Strategy.
        """
        return _make_strategy(self.file, self.player(name), self.base)


def match_path(game_or_path: str) -> Path:
    """The match file of a game by its name, or the path itself.

    Raises:
        ConfigError: neither.
    """
    path = Path(game_or_path)
    if path.suffix == ".toml" or path.is_file():
        if not path.is_file():
            raise ConfigError([f"{path}: no such file"])
        return path
    if game_or_path in GAMES:
        return Path(str(files("vrg.coordinator.games"))) / game_or_path.replace("-", "_") / "match.toml"
    raise ConfigError([f"expected a match file (*.toml) or a game ({', '.join(sorted(GAMES))}), got {game_or_path!r}"])


def read_match(path: Path) -> MatchFile:
    """A match file as it is written, with no look at what it names: players, maps, calibration files.

    Raises:
        ConfigError: it cannot be read, or has fields that it should not have.
    """
    try:
        return MatchFile.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, ValidationError) as error:
        raise ConfigError([f"{path}: cannot be read; `vrg check {path}` says more: {error}"]) from None


def load_match(path: Path, *, base: Path | None = None, **overrides: str | int | float | bool | None) -> MatchSetup:
    """Read and check a match file.

    Args:
        base: folder that relative paths in it start from; its own if missing.
        overrides: values for top-level fields that stand above the file's; None = none.

    Raises:
        ConfigError: with every problem as `file:line: field: what is wrong`.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError([f"{path}: cannot be read: {error}"]) from None
    lines = lines_of(text)
    text = with_values(text, {k: v for k, v in overrides.items() if v is not None})
    base = base or path.resolve().parent
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError([f"{path}:{syntax_error_line(error)}: not TOML: {error}"]) from None
    try:
        file = MatchFile.model_validate(data)
    except ValidationError as error:
        problems = _explain(error, path, lines, ())
        game = GAMES.get(str(data.get("game")))
        if game and isinstance(data.get("rules"), dict):
            problems += _rule_problems(game.settings, data["rules"], path, lines)
        raise ConfigError(sorted(set(problems), key=_line_number)) from None
    return _check(file, text, path, base, lines)


def _check(file: MatchFile, text: str, path: Path, base: Path, lines: dict[tuple[str | int, ...], int]) -> MatchSetup:
    game = GAMES[file.game]
    world = WorldConfig(
        map=file.map if "/" not in file.map and not file.map.endswith(".toml") else str(base / file.map),
        engine=file.engine,
        seed=file.seed,
        rate=1.0 if any(p.physical for p in file.players) else file.rate,
        lasers=file.lasers,
        noise=file.noise,
        robots=tuple(RobotSetup(name=p.name, model=p.model, pose=p.pose, physical=p.physical) for p in file.players),
    )
    problems = _rule_problems(game.settings, file.rules, path, lines) + _backend_problems(file, path, base, lines)
    for i, player in enumerate(file.players):
        if player.role not in game.roles:
            line = line_of(lines, ("players", i, "role"))
            known = ", ".join(game.roles)
            problems.append(f"{path}:{line}: players.{i}.role: expected one of {known}, got {player.role!r}")
        try:
            _make_strategy(file, player, base)
        except ConfigError as error:
            line = line_of(lines, ("players", i, "strategy"))
            problems += [f"{path}:{line}: players.{i}.strategy: {p}" for p in error.problems]
    problems += [_locate(p, file, path, lines) for p in check_setup(world)]
    if not problems:
        settings = game.settings.model_validate(file.rules)
        try:
            book = make_rulebook(file.game, settings, _contestants(file))
            problems += [_locate(p, file, path, lines) for p in _cluttered_zones(book, world)]
        except ConfigError as error:
            problems += [_locate(p, file, path, lines) for p in error.problems]
    if problems:
        raise ConfigError(sorted(problems, key=_line_number))
    return MatchSetup(file, text, base, settings, world)


def _make_strategy(file: MatchFile, player: PlayerEntry, base: Path) -> Strategy:
    """A player's strategy.

    Raises:
        ConfigError: it cannot be imported or made, or is no Strategy.
    """
    target = player.strategy or default_strategy(file.game)
    kind = import_object(target, base)
    if not (isinstance(kind, type) and issubclass(kind, Strategy)):
        raise ConfigError([f"{target}: expected a subclass of vrg.agents.strategy.Strategy, got {kind!r}"])
    try:
        return kind(player.name, robot_model(player.model))
    except Exception as error:
        raise ConfigError([f"{target}: cannot be made: {type(error).__name__}: {error}"]) from error


def _cluttered_zones(book: RuleBook[Any], world: WorldConfig) -> list[str]:
    """Zones where players line up, but where the map has walls or ends."""
    map_ = load_map(world.map)
    problems = []
    for zone in book.zones(book.initial()):
        if zone.kind == "field":
            continue
        middle = Pose((zone.x_min + zone.x_max) / 2, (zone.y_min + zone.y_max) / 2, 0.0)
        if not map_.footprint_clear(middle, zone.x_max - zone.x_min, zone.y_max - zone.y_min):
            problems.append(
                f"rules: the {zone.name} zone, x {zone.x_min:g} to {zone.x_max:g}, y {zone.y_min:g} to {zone.y_max:g}, "
                f"must be free of walls and obstacles and inside the bounds of map {map_.name!r}"
            )
    return problems


def _contestants(file: MatchFile) -> list[Contestant]:
    contestants = []
    for player in file.players:
        model = robot_model(player.model)
        contestants.append(
            Contestant(
                name=player.name,
                role=player.role,
                start=player.pose,
                size=(model.length, model.width),
                v_max=model.v_max,
            )
        )
    return contestants


def _rule_problems(
    settings: type[BaseModel], rules: dict[str, Any], path: Path, lines: dict[tuple[str | int, ...], int]
) -> list[str]:
    try:
        settings.model_validate(rules)
    except ValidationError as error:
        return _explain(error, path, lines, ("rules",))
    return []


def _backend_problems(file: MatchFile, path: Path, base: Path, lines: dict[tuple[str | int, ...], int]) -> list[str]:
    """What is wrong with the tables [backends.*]; also of those that no player has chosen, as one word chooses them."""
    problems = []
    for backend in sorted({player.backend for player in file.players} | set(file.backends)):
        users = {i: player.name for i, player in enumerate(file.players) if player.backend == backend}
        where = ("backends", backend)
        here = f"{path}:{line_of(lines, where)}: backends.{backend}"
        try:
            kind = settings_type(backend)
            if kind is not None and backend in file.backends:
                settings = kind.model_validate(file.backends[backend])
                found = settings.problems(list(users.values()), base)
                taken = {c.name for c in settings.companions(list(users.values()))} if not found else set()
                found += [
                    f"{p.name!r} is the name of another process of this match" for p in file.players if p.name in taken
                ]
                problems += [f"{here}: {problem}" for problem in found]
            elif kind is not None:
                line = line_of(lines, ("players", min(users), "backend"))
                wanted = f"expected a table [backends.{backend}], found none"
                problems.append(f"{path}:{line}: players.{min(users)}.backend: {wanted}")
            elif backend in file.backends:
                problems.append(f"{here}: this backend has no settings")
        except ConfigError as error:
            problems += [f"{here}: {problem}" for problem in error.problems]
        except ValidationError as error:
            problems += _explain(error, path, lines, where)
    return problems


def _explain(
    error: ValidationError, path: Path, lines: dict[tuple[str | int, ...], int], prefix: tuple[str, ...]
) -> list[str]:
    problems = []
    for detail in error.errors():
        where = (*prefix, *detail["loc"])
        message = detail["msg"].removeprefix("Value error, ")
        if detail["type"] == "extra_forbidden":
            message = "unknown field"
        elif detail["type"] == "missing":
            message = "missing"
        problems.append(f"{path}:{line_of(lines, where)}: {'.'.join(map(str, where)) or 'match'}: {message}")
    return problems


def _locate(problem: str, file: MatchFile, path: Path, lines: dict[tuple[str | int, ...], int]) -> str:
    """Put file and line before a problem that names players, of whom the first counts, or a top-level field."""
    named = [
        (found.start(), i)
        for i, player in enumerate(file.players)
        if (found := re.search(rf"(?<![\w-]){re.escape(player.name)}(?![\w-])", problem))
    ]
    if named:
        return f"{path}:{line_of(lines, ('players', min(named)[1]))}: {problem}"
    return f"{path}:{line_of(lines, (problem.split(':', maxsplit=1)[0],))}: {problem}"


def _line_number(problem: str) -> tuple[int, str]:
    match = re.match(r".*?:(\d+): ", problem)
    return (int(match[1]) if match else 0, problem)
