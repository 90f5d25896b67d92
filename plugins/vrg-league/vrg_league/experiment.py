"""The definition of an experiment: all that the outcome of its games depends on.

The folder of an experiment keeps its definition, so that an experiment that was interrupted goes on only with the same
one. How many games are played, how many at a time and with which confidence is no part of it.
"""

import hashlib
import importlib.util
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

from msgspec import Struct, structs

import vrg
from vrg import __version__
from vrg.config.setup import CheckedMatch, read_setup
from vrg.errors import Path as Place
from vrg.games import STRATEGIES, STRATEGY_FILES, file_of
from vrg.playing.branch import check_instant
from vrg.registry import plugins
from vrg.runs.change import Branch, Change, changes_in
from vrg.runs.keeping import files_of
from vrg.runs.run_folder import RunFolder
from vrg.toml_text import with_value
from vrg_league.contenders import Contender, teams_of, with_strategies
from vrg_league.games import Pairing, ScheduledGame


class Origin(Struct, frozen=True, kw_only=True):
    """The instant of a recorded match from which all games go on, one team by the strategies that are compared.

    Args:
        run: the path of its run folder. journal: the SHA-256 of its journal.
        time: the match time of the instant, s. team: that team. players: those of the team.
    """

    run: str
    journal: str
    time: float
    team: str
    players: list[str]

    @property
    def names(self) -> list[str]:
        """The names by which `by_player` finds the players of the team: its own, unless one of them bears it."""
        return self.players if self.team in self.players else [self.team]

    def branch(self, seed: int, changes: Sequence[Change]) -> Branch:
        """The branch of a game, with the noise of a seed from the instant on.

        Args:
            changes: the strategies of the team.

        Raises:
            LaunchError: the run folder is damaged.
        """
        earlier = changes_in(RunFolder(Path(self.run)))
        return Branch(self.run, [*earlier, Change(self.time, settings={"seed": seed}), *changes])


def origin_at(folder: RunFolder, time: float, team: str) -> Origin:
    """The origin of games at an instant of a recorded match.

    Args:
        folder: its run folder. time: the match time, s. team: the team that goes on by other strategies.

    Raises:
        LaunchError: it cannot be taken up there. JournalError: its evidence is damaged.
    """
    check_instant(folder, time)
    players = [player.name for player in read_setup(folder.setup).players if player.team == team]
    run = str(folder.path.resolve())
    return Origin(run=run, journal=_hash(folder.journal), time=time, team=team, players=players)


class Definition(Struct, frozen=True, kw_only=True):
    """All that the outcome of the games of an experiment depends on.

    Args:
        vrg: the release of VRG.
        match: the text of the match file, with the overrides. game: the name of the game.
        teams: the two teams. The first strategy of a pairing plays the first of them in games with even numbers.
        seed: the seed of the first pair; each next pair has the next seed.
        limit: the match time in s after which a game is broken off.
        contenders: the strategies.
        code: the SHA-256 of each file that the games depend on, by its name.
        origin: the instant from which they go on; None plays them from the beginning. Seeds are those of noise then.
    """

    vrg: str = __version__
    match: str
    game: str
    teams: tuple[str, str]
    seed: int
    limit: float
    contenders: list[Contender]
    code: dict[str, str]
    origin: Origin | None = None

    @property
    def digest(self) -> str:
        """Eight signs that differ between definitions."""
        return self._hashed[:8]

    @property
    def secret(self) -> str:
        """The secret of the matches: the same experiment has the same games, but no strategy knows all of it."""
        return self._hashed[8:40]

    @property
    def _hashed(self) -> str:
        return hashlib.sha256(repr(structs.astuple(self)).encode()).hexdigest()

    def game_of(self, pairing: Pairing, number: int) -> ScheduledGame:
        """A game of a pairing."""
        teams = self.teams if number % 2 == 0 else self.teams[::-1]
        return ScheduledGame(
            pairing=pairing, number=number, seed=self.seed + number // 2, first_team=teams[0], second_team=teams[1],
            only=None if self.origin is None else self.origin.team,
        )  # fmt: skip

    def differences(self, other: "Definition") -> list[str]:
        """The differences to another definition, in words."""
        found = []
        for name, what in (
            ("vrg", "the release of VRG"),
            ("game", "the game"),
            ("seed", "the seed"),
            ("limit", "the limit of match time"),
        ):
            ours, theirs = getattr(self, name), getattr(other, name)
            if ours != theirs:
                found.append(f"{what} is {ours} now and was {theirs}")
        if self.origin != other.origin:
            found.append("the instant from which the games go on differs")
        names, before = ([c.target for c in d.contenders] for d in (self, other))
        if names != before:
            found.append(f"the strategies are {', '.join(names)} now and were {', '.join(before)}")
        if self.match != other.match:
            found.append("the match file or an option that changes it (--engine, --lasers) differs")
        if names == before:
            changed = sorted(n for n in {*self.code, *other.code} if self.code.get(n) != other.code.get(n))
            found += [f"{name} has changed" for name in changed]
        return found


def define(
    setup: CheckedMatch, found: Sequence[Contender], *, seed: int, limit: float, origin: Origin | None = None
) -> Definition:
    """Define an experiment.

    Args:
        origin: see `Definition`; the match is the recorded one then.

    Raises:
        ConfigError: the match has not two teams, or a strategy cannot be imported.
    """
    return Definition(
        match=setup.text,
        game=setup.game,
        teams=teams_of(setup, None if origin is None else origin.team),
        seed=seed,
        limit=limit,
        contenders=list(found),
        code=dict(sorted(hash_ for contender in found for hash_ in _hashes(setup, contender))),
        origin=origin,
    )


def written(setup: CheckedMatch, strategies: dict[str, str], secret: str = "") -> CheckedMatch:
    """Return the match in which each team plays by its strategy, with its text.

    Args:
        strategies: the strategy of each team, with the whole path if it is that of a file.
        secret: of the match, where the file has none.
    """
    playing = with_strategies(setup, strategies)
    text = setup.text
    if secret and not setup.secret:
        text = with_value(text, ("secret",), secret)
    chosen: dict[Place, str] = {("players", player.number): player.strategy for player in playing.players}
    # The strategy of a team in the file may be a file that is not where the written match is.
    teams = tomllib.loads(text).get("teams", {})
    chosen |= {("teams", team): playing.player(name).strategy for team in teams for name in playing.followers(team)}
    for table, strategy in chosen.items():
        text = with_value(text, (*table, "strategy"), strategy)
    return structs.replace(playing, text=text)


def _hashes(setup: CheckedMatch, contender: Contender) -> Iterator[tuple[str, str]]:
    """The hashes of VRG, of the package or the file of a strategy, of the files beside it, and of the map."""
    yield "the code of VRG", code_of_vrg()
    if (file := file_of(contender.target)) is None:
        module = contender.target.rpartition(":")[0] or STRATEGIES.get(contender.target).__module__
    else:  # what another package reads such a file with plays, too
        reader = plugins(STRATEGY_FILES.group).get(Path(file).suffix[1:])
        module = "" if reader is None else reader.module
    # It is found and not imported: a strategy that is to be sealed has no business in this process.
    spec = importlib.util.find_spec(module.partition(".")[0]) if module else None
    if spec is not None and spec.origin is not None:
        path = Path(spec.origin)
        yield f"the code of {contender.label}", _hash(path.parent if path.name == "__init__.py" else path)
    target = contender.target
    if (entry := contender.source) is not None:
        yield f"{Path(contender.entry).name} of {contender.label}", entry.digest
        target = contender.label  # its files are those of the entry alone
    playing = written(setup, dict.fromkeys(teams_of(setup), target))
    for source_path in files_of(playing).copies.values():
        yield f"{source_path.name} of {contender.label}", _hash(source_path)


def code_of_vrg() -> str:
    """The SHA-256 of the code of VRG that runs here, with what plays and judges its games."""
    return _hash(Path(vrg.__file__).parent, Path(__file__).parent)


def _hash(*paths: Path) -> str:
    """The SHA-256 of files, and of the names and the content of all files of Python in folders."""
    digest = hashlib.sha256()
    for path in paths:
        for file in [path] if path.is_file() else sorted(path.rglob("*.py")):
            digest.update(f"{file.relative_to(path)}\0".encode() + file.read_bytes())
    return digest.hexdigest()
