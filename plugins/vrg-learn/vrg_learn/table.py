"""Decisions of recorded matches as one Parquet file, from which programs learn.

A row is one decision of one player in play: the run (the name of its folder), the match time in s, the round, the
player with its team, role and state, its strategy as the match file names it, what drove it, whether its own motion
counted (`able`), whether its team won (null for a draw, and for a match without an end), the observation and the
action, both lists of float32 of a fixed size. The metadata of the file, under the key `vrg`, names their values.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from msgspec import Struct
from pyarrow import parquet

from vrg.config.setup import MatchSetup
from vrg.coordinator.rulebook import DRAW, NOBODY
from vrg.errors import ConfigError, FileError
from vrg.files import decoded
from vrg.recording.recorded import RecordedMatch
from vrg_learn.action import limits_of
from vrg_learn.demonstration import Pairs
from vrg_learn.learning import learning_of
from vrg_learn.network import layout_of
from vrg_learn.observation import names
from vrg_learn.recorded import check, decisions

FORMAT: Final = 1
"""The number of the format that is written and read."""
ACTION: Final = ("v", "w", "side")
"""The names of the values of an action; `side` only where robots can drive sideways."""
_KEY: Final = b"vrg"
_UNITS: Final = {"time": {"unit": "s"}}
_WORDS: Final = pa.dictionary(pa.int32(), pa.string())
_WRITTEN_BY = "`vrg run export` writes such files"


class Heading(Struct, frozen=True, kw_only=True):
    """What a file says of its rows.

    Args:
        format: the number of the format. game: the game's name.
        observation, action: the names of their values, in order.
    """

    format: int
    game: str
    observation: tuple[str, ...]
    action: tuple[str, ...]

    @classmethod
    def of(cls, setup: MatchSetup) -> "Heading":
        """The heading of a file with the decisions of a match.

        Raises:
            ConfigError: these cannot be rebuilt; see `vrg_learn.recorded.check`.
        """
        check(setup)
        actions = len(limits_of(setup.players[0].robot))
        observation = names(learning_of(setup.game), len(setup.players))
        return cls(format=FORMAT, game=setup.game, observation=tuple(observation), action=ACTION[:actions])

    @property
    def schema(self) -> pa.Schema:
        """The columns, with this as metadata."""
        columns = {
            "run": _WORDS,
            "time": pa.float64(),
            "round": pa.int32(),
            **dict.fromkeys(("player", "team", "role", "state", "strategy", "driver"), _WORDS),
            "able": pa.bool_(),
            "won": pa.bool_(),
            "observation": pa.list_(pa.float32(), len(self.observation)),
            "action": pa.list_(pa.float32(), len(self.action)),
        }
        fields = [pa.field(name, kind, metadata=_UNITS.get(name)) for name, kind in columns.items()]
        return pa.schema(fields, metadata={_KEY: msgspec.json.encode(self)})


def rows(heading: Heading, setup: MatchSetup, run: str, recorded: RecordedMatch) -> pa.Table:
    """The rows of one run.

    Args:
        setup: of the match; see `decisions`. run: the name of its folder.

    Raises:
        ConfigError: as `decisions`.
    """
    found = list(decisions(setup, recorded))
    strategies = {player.name: player.strategy for player in setup.players}
    winner = recorded.states[-1][1].winner if recorded.states else None
    decided = winner not in (None, DRAW, NOBODY)
    columns: dict[str, list[Any]] = {
        "run": [run] * len(found),
        "time": [row.time for row in found],
        "round": [row.round for row in found],
        **{what: [getattr(row.me, what) for row in found] for what in ("team", "role", "state")},
        "player": [row.me.name for row in found],
        "strategy": [strategies[row.me.name] for row in found],
        "driver": [row.driver.value for row in found],
        "able": [row.able for row in found],
        "won": [row.me.team == winner if decided else None for row in found],
    }
    schema = heading.schema
    arrays = {
        name: pa.array(columns[name], pa.string()).dictionary_encode()
        if kind == _WORDS
        else pa.array(columns[name], kind)
        for name, kind in zip(schema.names, schema.types, strict=True)
        if name in columns
    }
    for name in ("observation", "action"):
        values = np.array([getattr(row, name) for row in found], dtype=np.float32)
        arrays[name] = pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), len(getattr(heading, name)))
    return pa.table(arrays, schema=schema)


def write(file: Path, heading: Heading, tables: Iterable[pa.Table]) -> int:
    """Write a file, and return the number of its rows. Nothing is left of one that does not become whole.

    Args:
        tables: as `rows` makes them, one after the other.

    Raises:
        ConfigError: it cannot be written.
        Exception: what `tables` raises.
    """
    if file.is_dir():
        raise ConfigError(f"{file}: expected the path of a file, got a folder: {file / 'pairs.parquet'} would be one")
    partial, count = file.with_name(f".{file.name}.partial"), 0
    try:
        with parquet.ParquetWriter(partial, heading.schema, compression="zstd") as writer:
            for table in tables:
                writer.write_table(table)
                count += len(table)
        partial.replace(file)
    except OSError as error:
        raise ConfigError(f"{file}: cannot be written: {error.strerror or error}: choose another place") from None
    finally:
        partial.unlink(missing_ok=True)
    return count


def read(file: Path, **only: str | bool) -> tuple[str, Pairs]:
    """Read the game of a file, and the pairs in it: only decisions of players whose own motion counted.

    Args:
        only: the values that a row must have, by column, such as `team="sharks"` or `won=True`.

    Raises:
        ConfigError: it is no such file, or one of another version of VRG; or no row has these values.
    """
    try:
        heading = _heading(file, parquet.read_schema(file).metadata or {})
        # Rows are read with their words, so that a wrong one can be told from those that are there.
        table = parquet.read_table(file, columns=["able", *only, "observation", "action"])
    except (OSError, pa.ArrowException) as error:
        raise ConfigError(f"{file}: cannot be read: {error}: {_WRITTEN_BY}") from None
    table = table.filter(pc.field("able"))
    if not len(table):
        raise ConfigError(f"{file}: expected decisions of players that might move, found none: export other runs")
    for name, value in only.items():
        known = [word for word in pc.unique(table[name]).to_pylist() if word is not None]
        table = table.filter(pc.field(name) == value)
        if not len(table):
            if name == "won":
                raise ConfigError(
                    f"{file}: expected decisions with `won` {value}, but none of the chosen ones is: choose "
                    "other players or runs, or leave this choice out"
                )
            raise ConfigError(f"{file}: {name}: expected one of {', '.join(map(str, known))}, got {value}")
    arrays = [table[name].combine_chunks().flatten().to_numpy() for name in ("observation", "action")]
    observations, actions = (array.reshape(len(table), -1) for array in arrays)
    return heading.game, Pairs(observations, actions)


def _heading(file: Path, metadata: Mapping[bytes, bytes]) -> Heading:
    """What a file says of its rows.

    Raises:
        ConfigError: it is no such file, or one of another version of VRG.
    """
    if _KEY not in metadata:
        raise ConfigError(f"{file}: expected decisions of recorded matches: {_WRITTEN_BY}")
    try:
        heading = decoded(msgspec.json.Decoder(Heading), metadata[_KEY])
    except FileError as error:
        raise ConfigError(f"{file}: expected decisions of recorded matches: {error}: {_WRITTEN_BY}") from None
    learning = learning_of(heading.game, file)
    own, slot = map(len, layout_of(learning))
    players = 1 + max(0, len(heading.observation) - own) // slot
    if heading.format != FORMAT or heading.observation != tuple(names(learning, players)):
        raise ConfigError(f"{file}: expected what this version of VRG shows in {heading.game}: export the runs again")
    return heading
