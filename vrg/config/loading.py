"""The reader of match files, which checks everything in them."""

import contextlib
import dataclasses
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from msgspec import structs
from pydantic import TypeAdapter, ValidationError

from vrg.config import checks
from vrg.config.files import HERE, PLACED, BodyEntry, MatchFile, PlayerEntry, TeamTable
from vrg.config.rules import rulebook_of
from vrg.config.setup import CheckedMatch, MatchSetup, PlayerSetup
from vrg.errors import ConfigError, FileError, Problem
from vrg.errors import Path as Place
from vrg.files import read_text, toml_of
from vrg.games import GAMES, STRATEGIES, file_of, has_name, unreadable
from vrg.games.game import Game
from vrg.hal.backends import BACKENDS, Companion
from vrg.hal.location import FEED
from vrg.hal.models import robot_model
from vrg.hal.models.settings import motion_problems
from vrg.hal.sim.config import check_setup
from vrg.hal.sim.map import load_map
from vrg.modules import classes_in, no_method
from vrg.registry import did_you_mean, expected_one_of, installed_by
from vrg.tables import Table, located, parsed, problems_in, problems_of
from vrg.toml_text import with_value, without

T = TypeVar("T")
M = TypeVar("M", bound=Table)

_FILE = TypeAdapter(MatchFile)
"""The validator of the tables of a match file, which reports all mistakes in them at once."""


def match_path(game_or_path: str) -> Path:
    """Return the default match file of a game by the game's name, or the path itself if it is one of a match file.

    A further match that a game ships is named after the game and its file, such as `pursuit-evasion-table-4-1`.

    Raises:
        ConfigError: there is no such file, and no such game.
    """
    path = Path(game_or_path)
    if path.suffix == ".toml" or path.is_file():
        if not path.is_file():
            there = [str(file) for file in path.parent.glob("*.toml") if _is_match(file)]
            if path.exists() or path.is_symlink():
                raise ConfigError(f"{path}: expected a regular file of a match, found none")
            raise ConfigError(f"{path}: no such file{did_you_mean(str(path), there)}")
        return path
    if game_or_path in GAMES:
        return GAMES.get(game_or_path).default_match()
    for game in (name for name in GAMES.names() if game_or_path.startswith(f"{name}-")):
        for file in GAMES.get(game).default_match().parent.glob("*.toml"):
            if game_or_path == f"{game}-{file.stem}":
                return file
    if wanted := installed_by(GAMES.group, game_or_path):
        raise ConfigError(f"game: got {game_or_path!r}, which {wanted}")
    own = path.with_name(f"{path.name}.toml")
    guess = (
        f", did you mean {str(own)!r}?" if path.name and own.is_file() else did_you_mean(game_or_path, GAMES.names())
    )
    raise ConfigError(
        f"expected a match file (*.toml) or a game ({', '.join(GAMES.names())}), got {game_or_path!r}{guess}"
    )


def _is_match(path: Path) -> bool:
    """True for a file that names a game, as no other file in TOML does."""
    try:
        return "game" in toml_of(read_text(path))
    except (OSError, FileError, tomllib.TOMLDecodeError):
        return False


def read_match(path: Path) -> MatchFile:
    """Read a match file without checking what it names, such as strategies, maps and calibration files.

    Raises:
        ConfigError: it cannot be read, or a field is unknown, missing or wrong.
    """
    try:
        return _FILE.validate_python(toml_of(read_text(path)))
    except (OSError, FileError, tomllib.TOMLDecodeError, ValidationError) as error:
        raise ConfigError(f"{path}: cannot be read; `vrg check {path}` has more: {error}") from None


def load_match(
    path: Path, *, base: Path | None = None, virtual: bool = False, **overrides: str | int | float | bool | None
) -> CheckedMatch:
    """Read and check a match file. The players' strategies are not imported; for them see `check_strategies`.

    Args:
        base: the folder that relative paths in it start from. The default is the file's own folder.
        virtual: True lets all robots be virtual, whatever their backends.
        overrides: values that replace those of top-level fields. None keeps the file's value.

    Raises:
        ConfigError: the file has problems. The error lists all of them, each with the file and the line.
    """
    try:
        text = read_text(path)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
    except FileError as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    return check_match(text, path, base or path.resolve().parent, virtual=virtual, **overrides)


def check_match(
    text: str, path: Path, base: Path, *, virtual: bool = False, **overrides: str | int | float | bool | None
) -> CheckedMatch:
    """Check the text of a match file, which need not have been written yet.

    Args:
        path: of the file, for messages. base: the folder that relative paths in it start from.
        virtual, overrides: as for `load_match`.

    Raises:
        ConfigError: the text has problems. The error lists all of them, each with the file and the line.
    """
    data, original = parsed(text, path), text
    for field, value in overrides.items():
        if value is not None:
            text = with_value(text, (field,), value)
            data[field] = value
    if virtual:
        for place in _of_physical_robots(data):
            text = without(text, place)
        data = parsed(text, path)
    checker = _Checker(base)
    setup = checker.check(data, text, str(path))
    if setup is None or checker.problems:
        typed = {(field,) for field, value in overrides.items() if value is not None}
        apart = [problem for problem in checker.problems if problem.path in typed]  # they are not in the file
        in_file = (checker.numbered(problem) for problem in checker.problems if problem.path not in typed)
        raise ConfigError([*apart, *located(in_file, path, original)])
    return setup


def _of_physical_robots(data: Mapping[str, Any]) -> list[Place]:
    """The places in a match file of what makes robots physical, and of what only such robots have."""
    players, sources, place = (data.get(name) for name in ("players", "localisation", "place"))
    tables = dict(enumerate(players)) if isinstance(players, list) else {}
    sources = sources if isinstance(sources, dict) else {}
    # What sees real robots sees no virtual ones: each then measures its own pose.
    real = any(isinstance(table, dict) and table.get("source") != "sim" for table in sources.values())
    found: list[Place] = [("localisation", name) for name in sources if real]
    for number, table in tables.items():
        if isinstance(table, dict):
            found.append(("players", number, "backend"))
            found += [("players", number, "localisation")] * (real or table.get("localisation") == FEED)
    bodies = data.get("bodies")
    found += [("bodies", n, "localisation") for n in range(len(bodies) if isinstance(bodies, list) else 0) if real]
    return [*found, *(("place", process) for process in place or () if process not in PLACED)]


def idle_machines(setup: CheckedMatch) -> str:
    """A warning about the machines of a match file on which nothing runs; empty if there are none."""
    if not setup.idle:
        return ""
    names = ", ".join(setup.idle)
    return f"nothing runs on {names}: name it as the `machine` of a player or in [place], or remove its table"


def unverified_properties(setup: MatchSetup) -> list[str]:
    """The properties of the robots that the match file alone cannot prove, in words."""
    return [text for _, settings, robots in setup.backend_settings() for text in settings.unverified(robots)]


def check_strategies(setup: CheckedMatch, make: Callable[[MatchSetup, str], object]) -> None:
    """Check that every player's strategy can be made.

    Args:
        make: makes the strategy of a player, given the set-up and the player's name.

    Raises:
        ConfigError: a strategy cannot be made. The error lists all problems, each with the file and the line.
    """
    problems = []
    for player in setup.players:
        try:
            make(setup, player.name)
        except ConfigError as error:
            problems += [Problem(p.text, ("players", player.number, "strategy")) for p in error.problems]
    if problems:
        text = setup.text
        with contextlib.suppress(OSError, FileError):
            text = read_text(Path(setup.origin))  # without overrides, which are lines of their own
        raise ConfigError(located(problems, setup.origin, text))


class _Checker:
    """Collects the problems of one match file. The path of a problem may name a player instead of its number."""

    def __init__(self, base: Path) -> None:
        self._base = base
        self._numbers: Sequence[int] = ()
        """The numbers in the file of the players that are checked."""
        self._by_name: dict[str | int, int] = {}
        """The same by the players' names."""
        self._companions_at: dict[str, str] = {}
        """The machine of each companion, by the companion's name."""
        self.problems: list[Problem] = []

    def check(self, data: dict[str, Any], text: str, origin: str) -> CheckedMatch | None:
        """Return the set-up, or None if it cannot be made. The problems are added to `problems`."""
        try:
            file = _FILE.validate_python(data)
            self._numbers = range(len(file.players))
        except ValidationError as error:
            lists = {"players": PlayerEntry.__struct_fields__, "bodies": BodyEntry.__struct_fields__}
            self.problems += problems_of(error, fields=MatchFile.__struct_fields__, lists=lists)
            # All that is left is checked too, so that a person sees all mistakes at once.
            try:
                file = self._without_mistakes(data, [detail["loc"] for detail in error.errors()])
            except ValidationError:
                return None
        self._by_name = {player.name: number for player, number in zip(file.players, self._numbers, strict=True)}
        names = None if self.problems else {player.name for player in file.players}
        game = self._attempt(lambda: GAMES.get(file.game), "game")
        if game is None:
            return None
        if data.get("players") == []:
            self.problems.append(Problem("expected at least one of them, got none", ("players",)))
        # The problems of the rules are found first, so that a rule book is made only from good settings.
        good_rules = isinstance(data.get("rules"), dict) and self._check_rules(game, file.rules)
        companions = self._check_backends(file)
        self.problems += checks.radio_problems(file.radio, names)
        self.problems += checks.sensor_problems(file.sensors)
        self.problems += checks.localisation_problems(file, self._base)
        self.problems += checks.body_problems(file)
        self._check_teams(game, file.teams)
        self.problems += checks.machine_problems(file, self._companions_at)
        machines, place = checks.machines_of(file, self._companions_at)
        players = [player for index in range(len(file.players)) if (player := self._player(game, file, index))]
        tracked = any(body.localisation for body in file.bodies)
        setup = CheckedMatch(
            **structs.asdict(file)
            | {
                # Another machine, or another Python, may have another default.
                "text": text if "engine" in data else with_value(text, ("engine",), file.engine),
                "origin": origin,
                "base": str(self._base),
                "map": str(self._base / file.map) if "/" in file.map or file.map.endswith(".toml") else file.map,
                "rate": 1.0 if any(player.physical for player in players) or tracked else file.rate,
                "wanted_rate": file.rate,
                "players": players,
                "companions": companions,
                "machines": machines,
                "place": place,
                "idle": [name for name in file.machines if name != HERE and name not in machines],
            }
        )
        self.problems += check_setup(setup.world)
        if not self.problems:
            setup = structs.replace(setup, obstacles=list(load_map(setup.map).obstacles))
        if good_rules and not self.problems:
            book = self._attempt(lambda: rulebook_of(setup))
            if book is not None:
                self.problems += checks.zone_problems(book, setup.world)
        return setup

    def _without_mistakes(self, data: dict[str, Any], mistakes: Sequence[Place]) -> MatchFile:
        """The match file without the fields and players that have mistakes.

        Raises:
            ValidationError: too little is left.
        """
        wrong, bad = {place[0] for place in mistakes}, {place[:2] for place in mistakes}
        tables = data.get("players")
        # The checks of players depend on their backends.
        tables = tables if isinstance(tables, list) and "backends" not in wrong else []
        self._numbers = [number for number in range(len(tables)) if ("players", number) not in bad]
        rest = {key: value for key, value in data.items() if key not in wrong}
        rest = {"name": "unnamed", "map": "open", "rules": {}, **rest, "players": [tables[n] for n in self._numbers]}
        if "machines" in wrong and isinstance(data["machines"], dict):
            # A machine whose table has a mistake is still one that others may refer to.
            for name, table in data["machines"].items():
                stand_in = {} if name == HERE else {"host": "unknown", "router": True}
                rest.setdefault("machines", {})[name] = stand_in if ("machines", name) in bad else table
        return _FILE.validate_python(rest)

    def numbered(self, problem: Problem) -> Problem:
        """The problem, with the number of a player in place of its name in the path; the name is then in the text."""
        path = problem.path
        if len(path) < 2 or path[0] != "players" or path[1] not in self._by_name:
            return problem
        name = str(path[1])
        text = problem.text if name in problem.text else f"{name}: {problem.text}"
        return Problem(text, ("players", self._by_name[name], *path[2:]), problem.file, problem.line)

    def _attempt(self, action: Callable[[], T], *where: str | int) -> T | None:
        """Return the action's result, or None after adding its problems to the list."""
        try:
            return action()
        except ConfigError as error:
            self.problems += [p if p.path or p.file else Problem(p.text, where) for p in error.problems]
            return None

    def _check_rules(self, game: Game, rules: dict[str, Any]) -> bool:
        settings = self._attempt(game.load_settings, "game")
        return settings is not None and self._table(settings, rules, ("rules",)) is not None

    def _table(self, kind: type[M], table: dict[str, Any], where: Place) -> M | None:
        """A table of the file after its check, or None after adding its problems to the list."""
        try:
            return kind.model_validate(table)
        except ValidationError as error:
            self.problems += problems_in(error, kind, where)
            return None

    def _player(self, game: Game, file: MatchFile, index: int) -> PlayerSetup | None:
        entry, number = file.players[index], self._numbers[index]
        where = ("players", number)
        backend = self._attempt(lambda: BACKENDS.get(entry.backend), *where, "backend")
        if backend is None:
            return None
        role = game.role(entry.role)
        if role is None or entry.role not in game.start_roles:
            known = ", ".join(game.start_roles)
            self.problems.append(Problem(f"expected one of {known}, got {entry.role!r}", (*where, "role")))
            return None
        if entry.localisation == FEED and not backend.physical:
            self.problems.append(Problem("a virtual robot has fusion or none", (*where, "localisation")))
        team = file.teams.get(role.team)
        shared = team.strategy if team and game.follows_team(entry.role) else None
        strategy = entry.strategy or shared or game.strategy_of(entry.role)
        self._check_strategy(entry.strategy, where)
        if entry.machine not in (machines := list(dict.fromkeys([HERE, *file.machines]))):
            self.problems.append(Problem(expected_one_of(machines, entry.machine), (*where, "machine")))
        if entry.name in self._companions_at:
            text = f"{entry.name!r} is the name of another process of this match"
            self.problems.append(Problem(text, (*where, "name")))
        sensors = self._attempt(lambda: checks.sensors_of(file, entry, where))
        strange = [Problem(p.text, (*where, "motion", *p.path)) for p in motion_problems(entry.motion)]
        self.problems += strange
        return PlayerSetup(
            **structs.asdict(entry)
            | {
                "team": role.team,
                "physical": backend.physical,
                "strategy": strategy,
                "number": number,
                "sensors": sensors or {},
                "motion": {} if strange else entry.motion,
            }
        )

    def _check_teams(self, game: Game, teams: Mapping[str, TeamTable]) -> None:
        known = list(dict.fromkeys(role.team for role in game.roles))
        for name, team in teams.items():
            if name in known:
                self._check_strategy(team.strategy, ("teams", name))
            else:
                text = f"expected one of the teams {', '.join(known)}, got {name!r}"
                self.problems.append(Problem(text, ("teams", name)))

    def _check_strategy(self, strategy: str | None, where: Place) -> None:
        """Check that there is a strategy of this name or a file at this place, for the table at `where`."""
        if strategy is None:
            return
        place, file = (*where, "strategy"), file_of(strategy)
        if has_name(strategy):
            if strategy not in STRATEGIES:
                self.problems.append(Problem(STRATEGIES.expected(strategy), place))
        elif file == strategy and (why := unreadable(strategy)):
            self.problems.append(Problem(why, place))
        elif file is not None and not (self._base / file).is_file():
            self.problems.append(Problem(f"{strategy}: no such file: {self._base / file}", place))
        # What needs no import is reported before anything starts, also where strategies are imported in a sandbox only.
        elif file is not None and file != strategy:
            found = classes_in(self._base / file).get(strategy.rpartition(":")[2])
            if found and found.acts is False:
                self.problems.append(Problem(no_method(strategy, "act", found.methods), place))

    def _check_backends(self, file: MatchFile) -> list[Companion]:
        """Check the tables [backends.*] and return the companions of the players' robots.

        The table of a backend that no player uses is checked too, because a small edit of the file may choose it.
        """
        companions: list[Companion] = []
        for backend in sorted({player.backend for player in file.players} | set(file.backends)):
            users = [player for player in file.players if player.backend == backend]
            where = ("backends", backend)
            kind = self._attempt(lambda: BACKENDS.get(backend), *where)  # noqa: B023 - called at once
            if kind is None:
                continue
            if kind.settings is None:
                if backend in file.backends:
                    self.problems.append(Problem("this backend has no settings", where))
            elif backend not in file.backends:
                text = f"expected a table [backends.{backend}], found none"
                number = self._numbers[file.players.index(users[0])]
                self.problems.append(Problem(text, ("players", number, "backend")))
            elif settings := self._table(kind.settings, file.backends[backend], where):
                models = {}
                for player in users:
                    with contextlib.suppress(ConfigError):  # it is told where the player is
                        models[player.name] = robot_model(player.model)
                if found := settings.problems(models, self._base):
                    self.problems += [Problem(text, where) for text in found]
                elif emulation := settings.emulation:
                    for machine in dict.fromkeys(player.machine for player in users):
                        there = [player.name for player in users if player.machine == machine]
                        companions += self._placed(emulation.companions(there), machine, companions)
        return companions

    def _placed(self, wanted: Sequence[Companion], machine: str, others: Sequence[Companion]) -> list[Companion]:
        """Companions of robots of one machine, which get other names than those of robots of other machines."""
        taken = {companion.name for companion in others}
        named = [dataclasses.replace(c, name=f"{c.name}-{machine}") if c.name in taken else c for c in wanted]
        self._companions_at.update({companion.name: machine for companion in named})
        return named
