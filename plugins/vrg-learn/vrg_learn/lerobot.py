"""Recorded matches as a data set of LeRobot, version 3.0 (its `LeRobotDataset`): Parquet files, and JSON about them.

An episode is one player in one round of one run; the task is to play the game in a role. Frames are the decisions of
the player at an even rate, as a data set has one: `timestamp` counts them, and `match_time` is the match time.
"""

import json
import math
import shutil
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from vrg.config.setup import MatchSetup
from vrg.coordinator.rulebook import DRAW, NOBODY
from vrg.errors import ConfigError
from vrg.recording.recorded import RecordedMatch
from vrg_learn.learning import learning_of
from vrg_learn.recorded import RecordedDecision, decisions
from vrg_learn.rewards import for_calls, for_winning
from vrg_learn.table import Heading

VERSION: Final = "v3.0"
FILE_SIZE: Final = 100
"""The size of a data file in MB, beyond which another one begins."""
CHUNK: Final = 1000
"""The files of a folder."""
_DATA: Final = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_EPISODES: Final = "meta/episodes/chunk-000/file-000.parquet"
QUANTILES: Final = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
"""The quantiles that are reported for each column, by LeRobot's names for them."""
_COUNTED: Final = ("timestamp", "frame_index", "episode_index", "index", "task_index")
"""The columns that every data set has."""


@dataclass
class RecordedEpisode:
    """One player in one round.

    Args:
        run: the name of the run. player, team: who it is. task: in words. frames: its decisions.
        rewards: what followed from each. won: its team has won the game.
    """

    run: str
    player: str
    team: str
    task: str
    frames: list[RecordedDecision] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    won: bool = False


def episodes(setup: MatchSetup, run: str, recorded: RecordedMatch) -> Iterator[RecordedEpisode]:
    """The episodes of a run, by player and round. The reward of a frame is that of the calls up to the next one.

    Args:
        setup: of the match; see `decisions`. run: the name of its folder.

    Raises:
        ConfigError: as `decisions`.
    """
    found: dict[tuple[str, int], RecordedEpisode] = {}
    for decision in decisions(setup, recorded):
        task = f"play {setup.game} as {decision.me.role}"
        key = decision.me.name, decision.round
        found.setdefault(key, RecordedEpisode(run, decision.me.name, decision.me.team, task)).frames.append(decision)
    teams = {player.name: player.team for player in setup.players}
    table = learning_of(setup.game).rewards
    calls = [(time, for_calls([call], table, teams)) for time, call in recorded.calls]
    winner = recorded.states[-1][1].winner if recorded.states else None
    last = max((round_ for _, round_ in found), default=0)
    for (name, round_), episode in found.items():
        times = [frame.time for frame in episode.frames]
        # What happens after the last decision of a round belongs to it, too.
        later = [other.frames[0].time for (who, number), other in found.items() if who == name and number > round_]
        ends = [*times[1:], min(later, default=math.inf)]
        marks = [bisect_right(calls, end, key=lambda entry: entry[0]) for end in (times[0], *ends)]
        episode.rewards = [sum(paid[name] for _, paid in calls[a:b]) for a, b in pairwise(marks)]
        episode.won = winner not in (None, DRAW, NOBODY) and teams[name] == winner
        if round_ == last:
            episode.rewards[-1] += for_winning(winner, teams)[name]
        yield episode


def write(folder: Path, heading: Heading, robot: str, runs: Iterable[Iterable[RecordedEpisode]]) -> tuple[int, int]:
    """Write a data set into a new folder; the number of its episodes, and of its frames.

    Args:
        heading: what observations and actions mean. robot: the model of the robots. runs: the episodes of each run.

    Raises:
        ConfigError: it cannot be written, or there is nothing to write. Exception: what `runs` raises.
    """
    if folder.exists():
        raise ConfigError(f"{folder}: exists already: name another folder with --output")
    partial = folder.with_name(f".{folder.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    book = _Book(partial, heading)
    try:
        for run in runs:
            for episode in run:
                book.add(episode)
        if not book.rows:
            raise ConfigError("expected decisions in play, found none: export other runs")
        book.close(robot)
        partial.replace(folder)
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be written: {error.strerror or error}: choose another place") from None
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return len(book.rows), book.index


class _Book:
    """Writes a data set, one episode after the other."""

    def __init__(self, folder: Path, heading: Heading) -> None:
        self._folder, self._heading = folder, heading
        self.rows: list[dict[str, Any]] = []
        self.index = 0
        self._tables: list[pa.Table] = []
        self._tasks: dict[str, int] = {}
        self._file = 0
        self._fps = 0

    def add(self, episode: RecordedEpisode) -> None:
        """Add an episode. The first one that has two frames decides the rate."""
        frames, count = episode.frames, len(episode.frames)
        steps = np.diff([frame.time for frame in frames])
        self._fps = self._fps or (round(1.0 / float(np.median(steps))) if count > 1 else 0)
        task = self._tasks.setdefault(episode.task, len(self._tasks))
        number = np.arange(count)
        columns: dict[str, np.ndarray[Any, Any]] = {
            "observation.state": np.array([frame.observation for frame in frames], np.float32),
            "action": np.array([frame.action for frame in frames], np.float32),
            "match_time": np.array([frame.time for frame in frames], np.float32),
            "able": np.array([frame.able for frame in frames], np.bool_),
            "next.reward": np.array(episode.rewards, np.float32),
            "next.done": number == count - 1,
            "next.success": (number == count - 1) & episode.won,
            "timestamp": (number / (self._fps or 10)).astype(np.float32),
            "frame_index": number,
            "episode_index": np.full(count, len(self.rows)),
            "index": self.index + number,
            "task_index": np.full(count, task),
        }
        arrays = {
            name: pa.array(values) if values.ndim == 1
            else pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])
            for name, values in columns.items()
        }  # fmt: skip
        self._tables.append(pa.table(arrays))
        self.rows.append({
            "episode_index": len(self.rows), "tasks": [episode.task], "length": count,
            "data/chunk_index": self._file // CHUNK, "data/file_index": self._file % CHUNK,
            "dataset_from_index": self.index, "dataset_to_index": self.index + count,
            "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
            "run": episode.run, "player": episode.player, "team": episode.team,
            **{
                f"stats/{name}/{what}": numbers for name, values in columns.items()
                for what, numbers in statistics(values.reshape(count, -1)).items()
            },
        })  # fmt: skip
        self.index += count
        if sum(table.nbytes for table in self._tables) > FILE_SIZE * 1_000_000:
            self._flush()

    def _flush(self) -> None:
        self._write(self._data(self._file), pa.concat_tables(self._tables))
        self._tables, self._file = [], self._file + 1

    def _data(self, number: int) -> str:
        """The path of a data file."""
        return _DATA.format(chunk_index=number // CHUNK, file_index=number % CHUNK)

    def close(self, robot: str) -> None:
        """Write what is about the whole."""
        if self._tables:
            self._flush()
        self._write(_EPISODES, pa.Table.from_pylist(self.rows))
        tasks = pa.table({"task_index": list(self._tasks.values()), "task": list(self._tasks)})
        self._write("meta/tasks.parquet", tasks.replace_schema_metadata({"pandas": json.dumps(_PANDAS)}))
        files, columns = [self._folder / self._data(number) for number in range(self._file)], features(self._heading)
        # One column is read at a time, as all of them need much memory.
        read = ((name, parquet.read_table(files, columns=[name])[name]) for name in columns)
        self._json("stats.json", {name: statistics(_rows(column)) for name, column in read})
        self._json("info.json", {
            "codebase_version": VERSION, "robot_type": robot, "total_episodes": len(self.rows),
            "total_frames": self.index, "total_tasks": len(self._tasks), "chunks_size": CHUNK,
            "data_files_size_in_mb": FILE_SIZE, "video_files_size_in_mb": 200, "fps": self._fps or 10,
            "splits": {"train": f"0:{len(self.rows)}"}, "data_path": _DATA, "video_path": None,
            "features": columns,
        })  # fmt: skip

    def _write(self, path: str, table: pa.Table) -> None:
        (self._folder / path).parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(table, self._folder / path)

    def _json(self, name: str, content: Mapping[str, Any]) -> None:
        (self._folder / "meta" / name).write_text(json.dumps(content, indent=4), encoding="utf-8")


def features(heading: Heading) -> dict[str, Any]:
    """The columns of a data set: the kind, the shape and the names of the values of each."""

    def of(dtype: str, names: Sequence[str] | None = None) -> dict[str, Any]:
        return {"dtype": dtype, "shape": [len(names or [0])], "names": names}

    return {
        "observation.state": of("float32", heading.observation), "action": of("float32", heading.action),
        "match_time": of("float32"), "able": of("bool"), "next.reward": of("float32"), "next.done": of("bool"),
        "next.success": of("bool"), "timestamp": of("float32"),
        **{name: of("int64") for name in _COUNTED[1:]},
    }  # fmt: skip


def statistics(values: np.ndarray[Any, Any]) -> dict[str, list[Any]]:
    """What LeRobot tells of the values of a column, by its names. LeRobot estimates the quantiles; these are exact.

    Args:
        values: of shape (n, width); the least and the greatest are of their kind, all else is a float.
    """
    # One after the other, as all of a large data set need much memory.
    mean, std, *quantiles = np.array([_moments(column) for column in values.T]).T
    found = {"min": values.min(0), "max": values.max(0), "mean": mean, "std": std, "count": np.array([len(values)])}
    found |= zip(QUANTILES, quantiles, strict=True)
    return {name: numbers.tolist() for name, numbers in found.items()}


def _moments(values: np.ndarray[Any, Any]) -> list[float]:
    """The mean, the standard deviation and the quantiles."""
    exact = values.astype(np.float64)
    return [float(exact.mean()), float(exact.std()), *np.quantile(exact, list(QUANTILES.values()))]


def _rows(column: Any) -> np.ndarray[Any, Any]:
    """A column of a table as an array of shape (n, width)."""
    whole = column.combine_chunks()
    values = whole.flatten() if pa.types.is_fixed_size_list(whole.type) else whole
    return np.asarray(values.to_numpy(zero_copy_only=False)).reshape(len(whole), -1)


_PANDAS: Final = {
    "index_columns": ["task"],
    "column_indexes": [],
    "columns": [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": in_numpy, "metadata": None}
        for name, kind, in_numpy in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ],
    "creator": {"library": "pyarrow", "version": pa.__version__},
    "pandas_version": "2.0.0",
}
"""What lets pandas, by which LeRobot reads the tasks, take their words as the index."""
