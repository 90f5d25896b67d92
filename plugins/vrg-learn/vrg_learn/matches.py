"""The match of an environment: a match file with what an environment plays otherwise, and who drives whom."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from msgspec import structs

from vrg.config.loading import load_match, match_path
from vrg.config.setup import CheckedMatch, MatchSetup
from vrg.errors import ConfigError
from vrg.games import GAMES, STRATEGIES, file_of, has_name
from vrg.hal.sim.engines import ENGINES
from vrg.registry import did_you_mean, expected_one_of

M = TypeVar("M", bound=MatchSetup)


def match_of(match: str | Path | CheckedMatch, *, engine: str | None, lasers: bool | None) -> CheckedMatch:
    """The match of an environment: on this machine alone, as fast as possible, and with robots that are put on their
    marks.

    Args:
        match: a game's name, the path of a match file, or a match that was read. engine: the physics engine; None for
            that of the match. lasers: whether range finders are simulated; None for what the match says.

    Raises:
        ConfigError: there is no such match, it has problems, or a robot of it is a physical one.
    """
    if isinstance(match, CheckedMatch):
        setup = match
        if engine is not None:
            ENGINES.get(engine)
            setup = structs.replace(setup, engine=engine)
        if lasers is not None:
            setup = structs.replace(setup, lasers=lasers)
    else:
        setup = load_match(match_path(str(match)), engine=engine, lasers=lasers)
    if setup.physical:
        raise ConfigError(
            f"{setup.origin}: expected virtual robots, but those of {', '.join(setup.physical)} are physical ones, "
            "which no environment can hurry or put back: take `backend` out of their tables"
        )
    return put_on_marks(setup).all_here().at_rate(0.0)


def put_on_marks(setup: M) -> M:
    """The match whose robots are put on their marks at once before a round, if its game has that as a rule."""
    if "lineup" not in GAMES.get(setup.game).load_settings().model_fields:
        return setup
    return structs.replace(setup, rules={**setup.rules, "lineup": "place"})


def with_opponents(setup: CheckedMatch, opponents: Mapping[str, str]) -> tuple[CheckedMatch, set[str]]:
    """The match with other strategies, and the names of the players that have them.

    Args:
        opponents: strategies by the name of a player or of a team. That of a player goes first.

    Raises:
        ConfigError: there is no such player and no such team, or no such strategy.
    """
    teams: dict[str, list[str]] = {}
    for player in setup.players:
        teams.setdefault(player.team, []).append(player.name)
    players = [player.name for player in setup.players]
    if unknown := [name for name in opponents if name not in teams and name not in players]:
        known = [*players, *teams]
        guess = did_you_mean(unknown[0], known)
        raise ConfigError(f"opponents: expected players or teams ({', '.join(known)}), got {unknown[0]!r}{guess}")
    wanted = {
        name: strategy for team in teams if team in opponents for name in teams[team] for strategy in [opponents[team]]
    }
    wanted |= {name: strategy for name, strategy in opponents.items() if name in players}
    for name, strategy in wanted.items():
        setup = setup.substituted(name, _found(strategy))
    return setup, set(wanted)


def learners_of(setup: CheckedMatch, learners: Sequence[str] | None, opponents: set[str]) -> list[str]:
    """The players that learn, in the order of the match file.

    Args:
        learners: their names; None for all that are no opponents. opponents: those that were named.

    Raises:
        ConfigError: there is no such player, or it is named as an opponent too.
    """
    players = [player.name for player in setup.players]
    if learners is None:
        return [name for name in players if name not in opponents]
    if isinstance(learners, str):
        raise ConfigError(f"learners: expected a list of players, got the text {learners!r}: write [{learners!r}]")
    for name in learners:
        if name not in players:
            raise ConfigError(f"learners: {expected_one_of(players, name)}")
    if both := sorted(opponents.intersection(learners)):
        raise ConfigError(
            f"opponents: expected players that do not learn, got {', '.join(both)}: name them in one place"
        )
    return [name for name in players if name in learners]


def _found(strategy: str) -> str:
    """A strategy as a match file names it; that of a file is looked for from the working folder.

    Raises:
        ConfigError: there is none of this name, or no such file.
    """
    if has_name(strategy):
        if strategy not in STRATEGIES:
            raise ConfigError(f"opponents: {STRATEGIES.expected(strategy)}")
        return strategy
    if (path := file_of(strategy)) is not None:
        file = Path(path).resolve()
        if not file.is_file():
            raise ConfigError(f"opponents: {strategy}: no such file: {file}")
        return f"{file}{strategy.removeprefix(path)}"
    return strategy
