"""The strategies that are compared."""

import os
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from msgspec import Struct, structs

from vrg.config.setup import CheckedMatch
from vrg.config.targets import class_in, whole_target
from vrg.errors import ConfigError
from vrg.games import STRATEGIES, file_of, is_strategy_file
from vrg.runs.run_folder import scratch_folder
from vrg.types import printable
from vrg_league.entries import Source, entry_paths, read_entry, short
from vrg_league.game_process import GameProcess, ended, server_for
from vrg_league.games import FAILED

TRIAL = 30.0
"""The match time in s of the game that a strategy plays alone before it takes part."""
_LOOK = 0.1
"""The real time in s between two looks at whether a game takes too long."""


class Contender(Struct, frozen=True, kw_only=True):
    """One of the strategies that are compared.

    Args:
        label: its short name in tables and in the names of files.
        target: the strategy as a match file names it, with the whole path if it is that of a file.
        entry: the path of the entry of a folder that it is; see `vrg_league.entries`. It sees nothing of what lies
            beside that. Empty if it is not one, and may import what lies beside its file.
    """

    label: str
    target: str
    entry: str = ""

    @property
    def source(self) -> Source | None:
        """The files of its entry as they are now; None if it is not one.

        Raises:
            ConfigError: they cannot be read.
        """
        if not self.entry:
            return None
        source = read_entry(Path(self.entry))
        if source is None or source.problem:
            raise ConfigError(
                f"{self.entry}: {'expected a strategy, found none' if source is None else source.problem}"
            )
        return source

    def placed(self, folder: Path, place: str) -> str:
        """Its strategy as a match file in a folder names it, whose entry is copied to a place there.

        Raises:
            ConfigError: the entry cannot be read. OSError: it cannot be copied.
        """
        if (source := self.source) is None:
            return self.target
        source.write(folder / place)
        return f"{place}/{source.main}{self.target.removeprefix(file_of(self.target) or '')}"


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
        folders: whether a folder stands for all entries in it.

    Raises:
        ConfigError: one is a folder, and may not be, or cannot be read.
    """
    found, wrong = list[tuple[str, str, str]](), list[LeftOut]()
    for target in typed:
        if folders and Path(target).is_dir():
            for path in entry_paths(Path(target)):
                source = read_entry(path)
                if source is None:
                    continue
                try:
                    if source.problem:
                        raise ConfigError(source.problem)
                    file = path / source.main if path.is_dir() else path
                    found.append((source.entry, _whole(file), str(path.absolute())))
                except UnicodeEncodeError:
                    raise ConfigError(
                        f"{printable(target)}: its name is not in UTF-8: give the folder another one"
                    ) from None
                except ConfigError as error:
                    wrong.append(left_out(path.name.removesuffix(".py"), str(error)))
            continue
        file = Path(target)
        if file.suffix != ".py" and not is_strategy_file(target):
            whole = whole_target(target)
            if ":" in target or target in STRATEGIES:
                found.append((target.rpartition(":")[2], whole, ""))
            else:
                wrong.append(left_out(target, STRATEGIES.unknown(target)))
            continue
        try:
            found.append((file.stem, _whole(file), ""))
        except UnicodeEncodeError:
            wrong.append(left_out(ascii(file.stem), "its name is not in UTF-8: give the file another one"))
        except ConfigError as error:
            wrong.append(left_out(file.stem, str(error)))
    names, targets, entries = ([one[field] for one in found] for field in range(3))
    labelled = contenders(targets, names)
    return [structs.replace(one, entry=entry) for one, entry in zip(labelled, entries, strict=True)], wrong


def left_out(name: str, why: str) -> LeftOut:
    """A strategy that takes no part. Others have written the words, so signs that control a terminal are taken out."""
    return LeftOut(printable(name), printable(" ".join(why.split())))


def _whole(file: Path) -> str:
    """The only strategy of a file, as a match file anywhere names it.

    Raises:
        ConfigError: it has not just one. UnicodeEncodeError: its name is not in UTF-8.
    """
    str(file).encode()
    return whole_target(str(file) if is_strategy_file(str(file)) else f"{file}:{class_in(file)}")


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
    """Return the same match in which one of these teams plays by its strategy, apart from scouts and the like."""
    for team, strategy in by_team.items():
        for name in setup.followers(team):
            setup = setup.substituted(name, seen_from(Path(setup.base), strategy))
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
                home = place / str(len(waiting))
                try:
                    target = contender.placed(home, "entry")
                except (ConfigError, OSError) as error:
                    problems[contender] = Unable(str(error))
                    continue
                target = f"{home}/{target}" if contender.entry else target
                playing = with_strategies(setup, dict.fromkeys(teams or teams_of(setup), target))
                game = GameProcess(server, playing, setup.seed, home / "game", match_time)
                stack.callback(game.kill)
                running[game] = contender, time.monotonic()
            for game, played in ended(list(running), _LOOK):
                contender, _ = running.pop(game)
                if played.ended == FAILED:
                    problems[contender] = Unable(played.problem.replace(f"{game.folder.parent}/entry/", ""))
            for game, (contender, began) in list(running.items()):
                if time.monotonic() - began > patience:
                    game.kill()
                    del running[game]
                    what = f"the first {match_time:g} s of a game were not over after {patience:g} s"
                    words = f"{contender.target}: {what}: look for a loop that does not end"
                    problems[contender] = Unable(words, overdue=True)
    return {contender: problems[contender] for contender in found if contender in problems}
