"""The strategies that are compared."""

import os
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from msgspec import Struct, structs

from vrg.bus.names import normal
from vrg.config.setup import CheckedMatch
from vrg.config.targets import class_in, whole_target
from vrg.errors import ConfigError
from vrg.games import STRATEGIES, file_of, is_strategy_file
from vrg.runs.run_folder import scratch_folder
from vrg.types import printable
from vrg_league.game_process import GameProcess, ended, server_for
from vrg_league.games import FAILED

TRIAL = 30.0
"""The match time in s of the game that a strategy plays alone before it takes part."""
_LABEL_SIZE = 60
"""The number of bytes of a label. The name of a file has two, and may have 255."""
_LOOK = 0.1
"""The real time in s between two looks at whether a game takes too long."""


class Contender(Struct, frozen=True, kw_only=True):
    """One of the strategies that are compared.

    Args:
        label: its short name in tables and in the names of files.
        target: the strategy as a match file names it, with the whole path if it is that of a file.
    """

    label: str
    target: str


class Unable(NamedTuple):
    """Why a strategy cannot take part; `overdue` if its trial took too long, which a busy computer may cause."""

    problem: str
    overdue: bool = False


class LeftOut(NamedTuple):
    """A strategy that takes no part: its name, and the reason in a line."""

    name: str
    why: str


def entered(typed: Sequence[str], *, folders: bool) -> tuple[list[Contender], list[LeftOut]]:
    """The strategies that were typed, and those that cannot be found. A file gives its strategy its own name.

    Args:
        folders: whether a folder stands for all files of Python and of policies in it.

    Raises:
        ConfigError: one is a folder, and may not be.
    """
    found, wrong = list[tuple[str, str]](), list[LeftOut]()
    for target in typed:
        folder = Path(target)
        for file in _files(folder) if folders and folder.is_dir() else [folder]:
            own = is_strategy_file(str(file))
            if file.suffix != ".py" and not own:
                whole = whole_target(target)
                if ":" in target or target in STRATEGIES:
                    found.append((target.rpartition(":")[2], whole))
                else:
                    wrong.append(left_out(target, STRATEGIES.unknown(target)))
                continue
            try:
                str(file).encode()
                found.append((file.stem, whole_target(str(file) if own else f"{file}:{class_in(file)}")))
            except UnicodeEncodeError:
                wrong.append(left_out(ascii(file.stem), "its name is not in UTF-8: give the file another one"))
            except ConfigError as error:
                wrong.append(left_out(file.stem, str(error)))
    return contenders([target for _, target in found], [name for name, _ in found]), wrong


def left_out(name: str, why: str) -> LeftOut:
    """A strategy that takes no part. Others have written the words, so signs that control a terminal are taken out."""
    return LeftOut(printable(name), printable(" ".join(why.split())))


def _files(folder: Path) -> list[Path]:
    """The files of strategies in a folder, except those whose names begin with `.` or `_`."""
    return [file for file in sorted(folder.glob("[!._]*")) if file.suffix == ".py" or is_strategy_file(file.name)]


def contenders(targets: Sequence[str], names: Sequence[str] = ()) -> list[Contender]:
    """Give each strategy a label, with a number if others have the same.

    Args:
        names: that of each strategy; without them, each has its own name, or that of its class or its file.
    """
    wanted = [short(name) for name in names or map(_name_of, targets)]
    count = Counter(wanted)
    taken = {label for label in wanted if count[label] == 1}
    found = []
    for label, target in zip(wanted, targets, strict=True):
        numbered = (f"{label}-{number}" for number in range(1, len(wanted) + 1))
        own = label if count[label] == 1 else next(words for words in numbered if words not in taken)
        taken.add(own)
        found.append(Contender(label=own, target=target))
    return found


def _name_of(target: str) -> str:
    """The name of a strategy, of its class, or of the file that it is."""
    return Path(target).stem if file_of(target) == target else target.rpartition(":")[2]


def short(name: str) -> str:
    """A name with only such signs as may stand in the name of a file, and not too long for one."""
    words = "".join(sign if sign.isalnum() or sign in "-_ " else "-" for sign in " ".join(normal(name).split()))
    return words.encode()[:_LABEL_SIZE].decode(errors="ignore").strip() or "strategy"


def teams_of(setup: CheckedMatch, first: str | None = None) -> tuple[str, str]:
    """The two teams of a match, in the order of the match file.

    Args:
        first: the team that comes first in place of this order.

    Raises:
        ConfigError: there are not two, `first` is none of them, or a robot is a physical one.
    """
    if setup.physical:
        raise ConfigError(f"{setup.origin}: {', '.join(setup.physical)}: games are compared with virtual robots only")
    teams = list(dict.fromkeys(player.team for player in setup.players))
    if len(teams) != 2:
        found = ", ".join(teams)
        raise ConfigError(f"{setup.origin}: expected a match of two teams, found {len(teams)}: {found}")
    if first not in (None, *teams):
        raise ConfigError(f"{setup.origin}: expected a team, {teams[0]} or {teams[1]}, got {first}")
    return (teams[1], teams[0]) if first == teams[1] else (teams[0], teams[1])


def with_strategies(setup: CheckedMatch, by_team: dict[str, str]) -> CheckedMatch:
    """Return the same match in which every player of one of these teams plays by the strategy of the team."""
    for player in (player for player in setup.players if player.team in by_team):
        setup = setup.substituted(player.name, seen_from(Path(setup.base), by_team[player.team]))
    return setup


def seen_from(base: Path, target: str) -> str:
    """A strategy as a match file in the folder `base` names it: files in this folder by their relative path."""
    file = file_of(target)
    if file is not None and Path(file).is_absolute() and Path(file).is_relative_to(base):
        return Path(os.path.relpath(file, base)).as_posix() + target.removeprefix(file)
    return target


def unable(
    setup: CheckedMatch,
    found: Sequence[Contender],
    jobs: int,
    *,
    match_time: float,
    patience: float = 60.0,
    teams: Sequence[str] | None = None,
) -> dict[Contender, Unable]:
    """Let each strategy play the beginning of a game alone, and return why some of them cannot play.

    Args:
        teams: those for which it plays; None for both.
        jobs: the number of games at a time.
        match_time: of each game, s. If it is 0, the strategies are only made; otherwise one that fails too often in it
            cannot play, either.
        patience: the real time in s after which a game is given up.

    Raises:
        ConfigError: the match has not two teams.
        LaunchError: no game can be played.
    """
    # A match in which nobody is disqualified ends as soon as a strategy has failed for good.
    setup = structs.replace(setup, on_fault="halt")
    problems: dict[Contender, Unable] = {}
    waiting, running = list(found), dict[GameProcess, tuple[Contender, float]]()
    with scratch_folder() as place, ExitStack() as stack:
        server = server_for(setup.game, setup.engine)
        stack.callback(server.close)
        while waiting or running:
            while waiting and len(running) < jobs:
                contender = waiting.pop(0)
                playing = with_strategies(setup, dict.fromkeys(teams or teams_of(setup), contender.target))
                game = GameProcess(server, playing, setup.seed, place / str(len(waiting)), match_time)
                stack.callback(game.kill)
                running[game] = contender, time.monotonic()
            for game, played in ended(list(running), _LOOK):
                contender, _ = running.pop(game)
                if played.ended == FAILED:
                    problems[contender] = Unable(played.problem)
            for game, (contender, began) in list(running.items()):
                if time.monotonic() - began > patience:
                    game.kill()
                    del running[game]
                    what = f"the first {match_time:g} s of a game were not over after {patience:g} s"
                    words = f"{contender.target}: {what}: look for a loop that does not end"
                    problems[contender] = Unable(words, overdue=True)
    return {contender: problems[contender] for contender in found if contender in problems}
