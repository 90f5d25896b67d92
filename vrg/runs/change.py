"""The changes by which a match that was taken up from an instant of another one differs from that."""

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import Struct, structs

from vrg.config.loading import check_match, load_match
from vrg.config.rules import rulebook_of
from vrg.config.setup import CheckedMatch, MatchSetup
from vrg.config.targets import whole_target
from vrg.coordinator.rulebook import RuleBook
from vrg.errors import ConfigError, FileError, LaunchError
from vrg.files import decoded, read_bytes, write_whole
from vrg.games import file_of, has_name
from vrg.registry import expected_one_of
from vrg.runs.keeping import copy_into, files_of_strategy
from vrg.runs.run_folder import RunFolder
from vrg.toml_text import with_value

_TABLES: Final = ("rules", "radio")
"""The tables of a match file of which fields can be changed."""


class Change(Struct, frozen=True):
    """From an instant on a player plays by another strategy, or fields of the match file have other values.

    Args:
        time: the match time of the instant, s. player: its name; empty if no player changes.
        strategy: as `vrg.config.setup.PlayerSetup.strategy`.
        settings: values by field, such as `rules.passes`; see `amended`.
    """

    time: float
    player: str = ""
    strategy: str = ""
    settings: Mapping[str, Any] = {}

    def __str__(self) -> str:
        words = [f"{self.player} plays {self._name}"] if self.player else []
        return ", ".join([*words, *(f"{field} is {value}" for field, value in self.settings.items())])

    @property
    def _name(self) -> str:
        """The strategy as people call it: without the folder of its file."""
        return self.strategy if has_name(self.strategy) else Path(self.strategy).name


def by_player(setup: MatchSetup, wanted: Mapping[str, str], what: str = "players") -> dict[str, str]:
    """The strategy of each player of a match that is to have another one.

    Args:
        wanted: strategies, as people name them, by player, or by team for all that follow it. A name that a team and
            one of its players have is that player's.
        what: where they were named, for errors.

    Raises:
        ConfigError: there is no such player or team, or the strategy is a file without just one strategy.
    """
    found: dict[str, str] = {}
    _check_table(wanted, what, '{"ann": "mine.py"}')
    names = [player.name for player in setup.players]
    teams = list(dict.fromkeys(player.team for player in setup.players))
    for name, strategy in wanted.items():
        if not isinstance(name, str) or not isinstance(strategy, str):
            raise ConfigError(
                [f"{what}.{name}: expected the name of a strategy, or of a file with one, got {strategy!r}"]
            )
        own = [name] if name in names else setup.followers(name)
        if not own:
            raise ConfigError([f"{what}: {expected_one_of(list(dict.fromkeys([*teams, *names])), name)}"])
        found |= dict.fromkeys(own, whole_target(strategy))
    return found


def changes_at(
    setup: MatchSetup, time: float, players: Mapping[str, str], settings: Mapping[str, Any], what: str = "players"
) -> list[Change]:
    """The changes of an instant.

    Args:
        time: its match time, s. players, what: see `by_player`. settings: see `Change`.

    Raises:
        ConfigError: there is no such player, team or strategy.
    """
    _check_table(settings, "settings", '{"rules.passes": 3}')
    changes = [Change(time, settings=settings)] if settings else []
    return changes + [Change(time, name, target) for name, target in by_player(setup, players, what).items()]


def _check_table(found: object, what: str, example: str) -> None:
    if not isinstance(found, Mapping):
        raise ConfigError([f"{what}: expected a table such as {example}, got {found!r}"])


class Branch(Struct, frozen=True):
    """The origin of a match that was taken up from another one, as its run folder has it.

    Args:
        of: the path of the run folder with the recorded match.
        changes: what was changed, in the order of time.
    """

    of: str
    changes: list[Change]

    def __str__(self) -> str:
        return ", ".join(f"from {change.time:.1f} s on {change}" for change in self.changes)


def branch_of(folder: RunFolder) -> Branch | None:
    """The changes to the match of a run folder; None if it was played as its match file has it.

    Raises:
        LaunchError: the file that tells it is damaged.
    """
    try:
        return decoded(msgspec.json.Decoder(Branch), read_bytes(folder.branch))
    except FileNotFoundError:
        return None
    except (OSError, FileError) as error:
        raise LaunchError(f"{folder.branch}: cannot be read: {error}") from error


def changes_in(folder: RunFolder) -> list[Change]:
    """The changes to the match of a run folder, in the order of time.

    Raises:
        LaunchError: the file that tells them is damaged.
    """
    branch = branch_of(folder)
    return [] if branch is None else branch.changes


def write_branch(folder: RunFolder, branch: Branch) -> None:
    """Write into a run folder from which match, and with which changes, its match is taken up.

    Raises:
        OSError: it cannot be written.
    """
    write_whole(folder.branch, msgspec.json.encode(branch))


def kept(strategy: str, folder: RunFolder) -> str:
    """A strategy, which is copied into a run folder if it is a file.

    Raises:
        OSError: it cannot be copied.
    """
    file = file_of(strategy)
    # Files of the same name come from different folders.
    source = "" if file is None else hashlib.sha256(os.fsencode(Path(file).resolve().parent)).hexdigest()[:8]
    target, copies = files_of_strategy(strategy, Path("substitute", source))
    copy_into(folder, copies)
    if copies and (file := file_of(target)) is not None:
        target = f"{(folder.path / file).resolve()}{target.removeprefix(file)}"
    return target


def amended(setup: CheckedMatch, change: Change) -> CheckedMatch:
    """The match as it goes on after a change.

    Its `settings` may name fields of [rules] and [radio], and `seed`. Another seed changes the noise of sensors, what
    the radio loses, and what strategies draw that are made from then on; what the rules have drawn stays.

    Raises:
        ConfigError: there is no such player or field, or it cannot have this value.
    """
    text = setup.text
    for field, value in change.settings.items():
        table, _, name = field.partition(".")
        if field != "seed" and (table not in _TABLES or not name or "." in name):
            raise ConfigError(f"{field}: expected a field of [rules] or [radio], such as rules.passes, or seed")
        try:
            text = with_value(text, (table, name) if name else (table,), value)
        except KeyError:
            text = with_value(text, (table,), {name: value})
    if change.settings:
        found = check_match(text, Path(setup.origin), Path(setup.base))
        setup = structs.replace(setup, text=text, rules=found.rules, radio=found.radio, seed=found.seed)
    return setup.substituted(change.player, change.strategy) if change.player else setup


def books_of(setup: MatchSetup, folder: RunFolder) -> tuple[RuleBook[Any], list[tuple[float, RuleBook[Any]]]]:
    """The rule book of a match, and those that took its place, each with the match time in s from which it counts.

    Args:
        setup: the match as it began. folder: its run folder, with its file and the changes.

    Raises:
        ConfigError: the rules cannot be played with this set-up. LaunchError: the changes cannot be read.
    """
    later, changes = list[tuple[float, RuleBook[Any]]](), changes_in(folder)
    if changes:
        now = setup if isinstance(setup, CheckedMatch) else load_match(folder.match_file, engine=setup.engine)
    for change in changes:
        before, now = now, amended(now, change)
        if now.rules != before.rules:
            later.append((change.time, rulebook_of(structs.replace(setup, rules=now.rules))))
    return rulebook_of(setup), later
