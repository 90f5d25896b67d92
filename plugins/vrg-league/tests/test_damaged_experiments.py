"""Damaged files of an experiment are refused in words, and nobody waits for a pipe in their place."""

from collections.abc import Callable
from pathlib import Path

import pytest

from vrg.testing.damage import check_no_file, check_refused
from vrg_league.folder import GameRecord, read_definition, read_records

READERS: dict[str, tuple[bytes, Callable[[Path], object]]] = {
    "experiment.json": (b'{"match":"m","seed":1}', lambda path: read_definition(path.parent)),
    "games.jsonl": (b'{"game":{"number":1},"played":{}}\n', lambda path: read_records(path, GameRecord)),
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("count", [40, pytest.param(1000, marks=pytest.mark.thorough)])
def test_a_damaged_file_of_an_experiment_is_refused_in_words(tmp_path: Path, name: str, count: int) -> None:
    whole, read = READERS[name]
    check_refused(read, tmp_path / name, whole, count)


@pytest.mark.parametrize("name", READERS)
def test_nobody_waits_for_a_pipe_or_reads_a_device_as_an_experiment(tmp_path: Path, name: str) -> None:
    check_no_file(READERS[name][1], tmp_path, name)
