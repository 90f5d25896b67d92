"""The set-up of a match that has been checked: everything that its processes are made from, as plain data.

A process that is given a set-up needs neither the match file nor the code that checks match files.
"""

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

import msgspec
from msgspec import structs

from vrg.bus.topics import Keys
from vrg.config.files import HERE, Machine, MatchFile, PlayerEntry
from vrg.errors import ConfigError, FileError, LaunchError
from vrg.files import decoded, read_bytes, write_whole
from vrg.games import file_of, game_of
from vrg.hal.backends import BACKENDS, Companion
from vrg.hal.location import FUSION, ODOMETRY
from vrg.hal.models import RobotModel, robot_model
from vrg.hal.models.settings import with_motion, with_settings
from vrg.hal.sim.config import BodySetup, RobotSetup, WorldConfig
from vrg.modules import module_in
from vrg.regions import Region
from vrg.registry import did_you_mean
from vrg.seats.seat import Roster
from vrg.system import POSIX

if TYPE_CHECKING:
    from vrg.hal.settings import BackendSettings

RULES, NOISE = "rules", "noise"
"""The purposes of `MatchSetup.draw` that the referee and the world have."""


def team_seed(team: str) -> str:
    """The purpose of what the players of a team draw."""
    return f"team {team}"


def source_seed(source: str) -> str:
    """The purpose of what is drawn for a source of fixes."""
    return f"localisation {source}"


def radio_seed(player: str) -> str:
    """The purpose of what is drawn for the messages that a player hears."""
    return f"radio {player}"


class PlayerSetup(PlayerEntry, frozen=True, kw_only=True):
    """The set-up of one player: the table of the match file with what follows from the rest of the file.

    Args:
        team: the team of its role.
        physical: True if its robot is a physical one.
        strategy: `module:Class`, `file.py:Class`, `policy.npz`, or the name of a registered strategy.
        number: its place among the players of the match file, from 0.
        sensors: the numbers of its robot's sensors that are not those of the model, those of the match included.
    """

    team: str
    physical: bool
    strategy: str
    number: int
    sensors: dict[str, dict[str, int | float]]

    @property
    def robot(self) -> RobotModel:
        """The description of its robot, with the settings of its sensors in this match.

        For a physical robot, settings change only the sensors that the world simulates.
        """
        model = robot_model(self.model)
        kinds = {spec.kind for spec in model.sensors if spec.synthesised or not self.physical}
        model = with_motion(model, self.motion)
        return with_settings(model, {kind: own for kind, own in self.sensors.items() if kind in kinds})


class MatchSetup(MatchFile, frozen=True, kw_only=True):
    """The set-up of a match, as its processes get it: the values of the match file with what follows from them.

    Args:
        origin: the path of the match file, for messages. base: the folder that its relative paths start from.
        map: a map's name, or the path of its file. obstacles: the ground that its walls and obstacles cover, m.
        rate: match seconds per real second; 1 with any physical robot, for any rate in the file.
        companions: the processes that the players' robots need besides those of the players.
        machines: the machines that the match uses, by name. place: the machine of each process, by the process' name;
            what is missing runs where the match is launched.
        secret: what keeps the random numbers of the match from those who know its seed; empty if the match is to be
            repeatable by its seed.
        drawn: the numbers of one player, by purpose, in the set-up of its process, which has no secret.
    """

    origin: str
    base: str
    players: Sequence[PlayerSetup]
    companions: list[Companion]
    obstacles: Sequence[Region] = ()
    drawn: Mapping[str, int] = msgspec.field(default_factory=dict)

    def draw(self, purpose: str) -> int:
        """The seed of what is random for a purpose, from 0 to 2**63 - 1: a keyed hash of the seed and the purpose.

        The secret, or the number of another purpose, cannot be worked out from it.

        Raises:
            KeyError: this is the set-up of one player's process, and the purpose is not one of that player's.
        """
        if self.drawn:
            return self.drawn[purpose]
        text = f"{self.seed} {purpose}".encode()
        return int.from_bytes(hashlib.blake2b(text, key=self.secret.encode(), digest_size=8).digest()) >> 1

    def with_secret(self, secret: str) -> Self:
        """Return the same match with a secret of at most 64 bytes; an empty one makes it repeatable by its seed."""
        return structs.replace(self, secret=secret)

    def for_player(self, name: str) -> "MatchSetup":
        """Return the same match as the process of one player gets it: without what other players' numbers come from.

        These come from the seed, which the text of the match file has, too.

        Raises:
            ConfigError: there is no such player.
        """
        purposes = (team_seed(self.player(name).team), radio_seed(name))
        drawn = {purpose: self.draw(purpose) for purpose in purposes}
        return structs.replace(self.for_processes(), secret="", seed=0, drawn=drawn)

    def for_processes(self) -> "MatchSetup":
        """Return the same match without what only its launcher needs, such as the text of its file."""
        return MatchSetup(**{field: getattr(self, field) for field in MatchSetup.__struct_fields__})

    @property
    def keys(self) -> Keys:
        """The key map of this match."""
        return Keys(self.name)

    @property
    def roster(self) -> Roster:
        """The members of this match, for the keys of its seats and the router's rules."""
        fed = (*(player.name for player in self.players if player.localisation != ODOMETRY), *self.tracked)
        teams = {player.name: player.team for player in self.players}
        linked = any(machine.router for machine in self.machines.values())
        return Roster(self.name, teams, fed=fed, hosts=tuple(self.hosts), linked=linked)

    @property
    def has_seats(self) -> bool:
        """True if only processes with keys are admitted to the match."""
        return bool(self.hosts) if self.seats is None else self.seats

    def sandboxed(self, name: str, *, seats: bool) -> bool:
        """True if the process in which a player's strategy decides is sealed before its code is loaded.

        By default it is if its strategy is a file, and the match has seats or the file is a stranger's: it lies outside
        the folder of the match file, or belongs to another user.

        Args:
            seats: True if the match is played with seats.

        Raises:
            ConfigError: there is no such player.
        """
        if self.sandbox is not None:
            return self.sandbox
        file = self.strategy_file(name)
        return file is not None and (seats or self._is_strangers(file))

    def strategy_file(self, name: str) -> Path | None:
        """The file or the package of a player's strategy; None if that comes with an installed package.

        Raises:
            ConfigError: there is no such player.
        """
        base, strategy = Path(self.base).resolve(), self.player(name).strategy
        if (file := file_of(strategy)) is not None:
            return (base / file).resolve()
        module = strategy.rpartition(":")[0]
        found = module_in(base, module.split(".")[0]) if module else None
        return None if found is None else found.resolve()

    def _is_strangers(self, file: Path) -> bool:
        try:
            own = not POSIX or file.stat().st_uid == os.geteuid()
            return not file.is_relative_to(Path(self.base).resolve()) or not own
        except OSError:
            return True

    @property
    def trackers(self) -> list[str]:
        """The names of the processes that locate robots and things: the sources of fixes and the fusion centre."""
        return [*self.localisation, FUSION] if self.fused or self.tracked else []

    @property
    def fused(self) -> "list[PlayerSetup]":
        """The players whose robots the fusion centre locates."""
        return [player for player in self.players if player.localisation == FUSION]

    @property
    def tracked(self) -> dict[str, BodySetup]:
        """The passive bodies that the fusion centre locates, by name."""
        return {body.name: body.setup for body in self.bodies if body.localisation == FUSION}

    def played_by(self, strategy: str) -> list[str]:
        """The names of the players with a strategy, as the match file names it."""
        return [player.name for player in self.players if player.strategy == strategy]

    @property
    def physical(self) -> list[str]:
        """The names of the players whose robots are physical ones."""
        return [p.name for p in self.players if p.physical]

    def backend_settings(self) -> "Iterator[tuple[str, BackendSettings, list[str]]]":
        """The settings of each backend that has a table in the match file: its name, its table, and its robots."""
        for backend, table in self.backends.items():
            kind = BACKENDS.get(backend).settings
            if kind is not None:
                robots = [player.name for player in self.players if player.backend == backend]
                yield backend, kind.model_validate(table), robots

    @property
    def world(self) -> WorldConfig:
        """The set-up of the world of this match."""
        robots = (
            RobotSetup(
                name=p.name,
                model=p.model,
                pose=p.pose,
                physical=p.physical,
                sensors=p.sensors,
                motion=p.motion,
                camera=p.camera,
            )
            for p in self.players
        )
        return WorldConfig(
            map=self.map,
            engine=self.engine,
            seed=self.draw(NOISE),
            rate=self.rate,
            lasers=self.lasers,
            noise=self.noise,
            robots=tuple(robots),
            bodies=tuple(body.setup for body in self.bodies),
        )

    def player(self, name: str) -> PlayerSetup:
        """The player of this name.

        Raises:
            ConfigError: there is no such player.
        """
        for player in self.players:
            if player.name == name:
                return player
        names = [player.name for player in self.players]
        known, guess = ", ".join(names), did_you_mean(name, names)
        raise ConfigError(f"expected the name of a player of this match ({known}), got {name!r}{guess}")

    def followers(self, team: str) -> list[str]:
        """The players of a team that play by its strategy; see `Game.follows_team`."""
        game = game_of(self.game)
        return [player.name for player in self.players if player.team == team and game.follows_team(player.role)]

    def substituted(self, name: str, strategy: str) -> Self:
        """Return the same match in which a player plays by another strategy.

        Raises:
            ConfigError: there is no such player.
        """
        changed = structs.replace(self.player(name), strategy=strategy)
        return structs.replace(self, players=tuple(changed if p.name == name else p for p in self.players))

    @property
    def hosts(self) -> dict[str, Machine]:
        """The further machines, by name, on which processes of this match run."""
        return {name: machine for name, machine in self.machines.items() if machine.host}

    def router_at(self, machine: str) -> str:
        """The name of the machine whose router the processes of a machine use."""
        found = self.machines.get(machine)
        if found is not None and found.router:
            return machine
        return (found.via if found is not None else None) or self.place.get("router", HERE)

    def all_here(self) -> Self:
        """Return the same match on one machine."""
        return structs.replace(self, machines={}, place={})

    def at_rate(self, rate: float) -> Self:
        """Return the same match at another rate; 0 means as fast as the processor allows."""
        return structs.replace(self, rate=rate)


def unknown_match(name: str) -> MatchSetup:
    """The set-up of a match of which only the name is known: no robots, and no obstacles."""
    return MatchSetup(name=name, game="", map="", rules={}, players=(), companions=[], origin="", base="")


class CheckedMatch(MatchSetup, frozen=True, kw_only=True):
    """A match file that was checked: the set-up of its match with the text that it was read from.

    Args:
        text: the text of the match file, with the overrides and its engine.
        wanted_rate: the rate in the file. idle: the further machines of the file, on which nothing runs.
    """

    text: str
    wanted_rate: float
    idle: Sequence[str] = ()


def write_setup(setup: MatchSetup, path: Path) -> None:
    """Write a set-up for the processes of a match, without the text of its file. Other users cannot read it.

    Raises:
        LaunchError: the file cannot be written.
    """
    try:
        write_whole(path, msgspec.json.encode(setup.for_processes()), 0o600)
    except OSError as error:
        raise LaunchError(f"{path}: cannot be written: {error.strerror}: choose another place") from error


def read_setup(path: Path) -> MatchSetup:
    """Read a set-up that `write_setup` wrote.

    Raises:
        LaunchError: it cannot be read, or is of another release of VRG.
    """
    try:
        return decoded(msgspec.json.Decoder(MatchSetup), read_bytes(path))
    except OSError as error:
        raise LaunchError(f"{path}: cannot be read: {error.strerror}") from error
    except FileError as error:
        raise LaunchError(
            f"{path}: expected the set-up of a match of this release: {error}: use the VRG that played the match, or, "
            "if the file is damaged, a copy of it (match.toml beside it has the same match for `vrg play`)"
        ) from None
