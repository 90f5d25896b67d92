"""The strategies that are compared."""

import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from msgspec import Struct

from vrg.bus.names import normal
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.launch.apart import StrategyApart
from vrg.launch.fork_server import ForkServer
from vrg.launch.nodes import strategy_of
from vrg.launch.run_folder import RunFolder, scratch_folder


class Contender(Struct, frozen=True, kw_only=True):
    """One of the strategies that are compared.

    Args:
        label: its short name in tables and in the names of files.
        target: the strategy as a match file names it, with the whole path if it is that of a file.
    """

    label: str
    target: str


def contenders(targets: Sequence[str]) -> list[Contender]:
    """Give each strategy a label: its name or the name of its class, with a number if others have the same."""
    short = [_short(target) for target in targets]
    count, used = Counter(short), Counter[str]()
    found = []
    for label, target in zip(short, targets, strict=True):
        used[label] += 1
        found.append(Contender(label=f"{label}-{used[label]}" if count[label] > 1 else label, target=target))
    return found


def _short(target: str) -> str:
    """The name of a strategy or of its class, with only such signs as may stand in the name of a file."""
    word = normal(target.rpartition(":")[2])
    return "".join(sign if sign.isalnum() or sign in "-_" else "-" for sign in word) or "strategy"


def teams_of(setup: MatchSetup) -> tuple[str, str]:
    """The two teams of a match, in the order of the match file.

    Raises:
        ConfigError: there are not two, or a robot is a physical one.
    """
    if setup.physical:
        raise ConfigError(f"{setup.origin}: {', '.join(setup.physical)}: games are compared with virtual robots only")
    teams = list(dict.fromkeys(player.team for player in setup.players))
    if len(teams) != 2:
        found = ", ".join(teams)
        raise ConfigError(f"{setup.origin}: expected a match of two teams, found {len(teams)}: {found}")
    return teams[0], teams[1]


def with_strategies(setup: MatchSetup, by_team: dict[str, str]) -> MatchSetup:
    """Return the same match in which every player of a team plays by the strategy of the team."""
    for player in setup.players:
        setup = setup.substituted(player.name, seen_from(Path(setup.base), by_team[player.team]))
    return setup


def seen_from(base: Path, target: str) -> str:
    """A strategy as a match file in the folder `base` names it: files in this folder by their relative path."""
    path, colon, name = target.rpartition(":")
    if path.endswith(".py") and Path(path).is_absolute() and Path(path).is_relative_to(base):
        return f"{Path(os.path.relpath(path, base)).as_posix()}{colon}{name}"
    return target


def check(setup: MatchSetup, found: Sequence[Contender], apart: ForkServer | None = None) -> None:
    """Check that every strategy can play for every player.

    Args:
        apart: forks the processes of the strategies that are to be sealed; None makes all of them in this process.

    Raises:
        ConfigError: one cannot be imported or made. The error lists all such problems, each of them once.
    """
    problems: dict[str, None] = {}
    with scratch_folder() as place:
        for contender in found:
            playing = with_strategies(setup, dict.fromkeys(teams_of(setup), contender.target))
            for player in playing.players:
                try:
                    if apart is not None and playing.sandboxed(player.name, seats=True):
                        StrategyApart(apart, playing, player.name, RunFolder(place)).close()
                    else:
                        strategy_of(playing, player.name)
                except ConfigError as error:
                    problems.update(dict.fromkeys(map(str, error.problems)))
    if problems:
        raise ConfigError(list(problems))
