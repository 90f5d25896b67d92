"""Recorded matches as a data set of LeRobot: by what it says of itself, and by LeRobot where that is installed."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

import vrg
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY
from vrg_learn.learning import learning_of
from vrg_learn.rewards import for_calls, for_winning
from vrg_learn.table import Heading

RUNS = 2


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[vrg.Run]]:
    """A data set of two matches."""
    home = tmp_path_factory.mktemp("lerobot")
    runs = []
    for seed in range(RUNS):
        (home / f"{seed}.toml").write_text(TINY.replace('name = "tiny"', f'name = "tiny{seed}"'))
        runs.append(vrg.play(home / f"{seed}.toml", runs=home / "runs", seed=seed))
    done = invoke("run", "export", *(str(run.path) for run in runs), "--lerobot", "--output", str(home / "set"))
    assert done.exit_code == 0, done.output
    assert "6 episodes" in done.output
    return home / "set", runs


def test_a_data_set_is_what_it_says_of_itself(made: tuple[Path, list[vrg.Run]]) -> None:
    place, runs = made
    about = json.loads((place / "meta" / "info.json").read_text())
    table = parquet.read_table(place / about["data_path"].format(chunk_index=0, file_index=0))
    assert (about["codebase_version"], about["total_episodes"], about["fps"]) == ("v3.0", 3 * RUNS, 10)
    assert (len(table), set(table.column_names)) == (about["total_frames"], set(about["features"]))
    heading = Heading.of(runs[0].setup)
    assert tuple(about["features"]["observation.state"]["names"]) == heading.observation
    assert table["index"].to_pylist() == list(range(len(table)))
    episodes = parquet.read_table(place / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    tasks = parquet.read_table(place / "meta" / "tasks.parquet").to_pylist()
    assert {task["task"] for task in tasks} == {f"play sharks-and-minnows as {role}" for role in ("shark", "minnow")}
    assert {(row["run"], row["player"]) for row in episodes} == {
        (run.path.name, player.name) for run in runs for player in run.setup.players
    }
    for row in episodes:
        part = table.slice(row["dataset_from_index"], row["length"])
        assert row["dataset_to_index"] - row["dataset_from_index"] == row["length"]
        assert part["next.done"].to_pylist() == [False] * (row["length"] - 1) + [True]
        assert np.allclose(part["timestamp"].to_numpy(), np.arange(row["length"]) / 10, atol=1e-5)
        assert {tasks[number]["task"] for number in part["task_index"].to_pylist()} == set(row["tasks"])


def test_statistics_are_those_of_all_frames_and_of_each_episode(made: tuple[Path, list[vrg.Run]]) -> None:
    """By the names that LeRobot 0.4.4 writes: policies normalise by quantiles, and tools that edit a set need both."""
    place, _ = made
    table = parquet.read_table(place / "data/chunk-000/file-000.parquet")
    whole = json.loads((place / "meta" / "stats.json").read_text())
    rows = parquet.read_table(place / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert set(whole) == set(table.column_names)
    parts = [(table, whole)]
    for row in rows:
        told = {name: {what: row[f"stats/{name}/{what}"] for what in whole[name]} for name in whole}
        parts.append((table.slice(row["dataset_from_index"], row["length"]), told))
    assert len(parts) == 1 + 3 * RUNS
    quantiles = {"q01": 1.0, "q10": 10.0, "q50": 50.0, "q90": 90.0, "q99": 99.0}
    for part, told in parts:
        for name, numbers in told.items():
            values = np.array(part[name].to_pylist()).reshape(len(part), -1)
            assert list(numbers) == ["min", "max", "mean", "std", "count", *quantiles], name
            assert (numbers["min"], numbers["max"]) == (values.min(0).tolist(), values.max(0).tolist()), name
            assert numbers["count"] == [len(part)]
            expected = {"mean": values.mean(0), "std": values.std(0)}
            expected |= {what: np.percentile(values.astype(float), at, axis=0) for what, at in quantiles.items()}
            for what, right in expected.items():
                assert np.allclose(numbers[what], right, rtol=1e-9, atol=1e-12), (name, what)


def test_rewards_are_those_of_calls_and_of_winning(made: tuple[Path, list[vrg.Run]]) -> None:
    place, runs = made
    table = parquet.read_table(place / "data/chunk-000/file-000.parquet")
    paid = sum(table["next.reward"].to_pylist())
    expected = 0.0
    for run in runs:
        teams = {player.name: player.team for player in run.setup.players}
        expected += sum(for_calls(run.calls, learning_of(run.setup.game).rewards, teams).values())
        expected += sum(for_winning(run.winner, teams).values())
    assert any(call.rule == "tag" for run in runs for call in run.calls)
    assert paid == pytest.approx(expected, abs=1e-5), "none is lost between frames"
    successes = table["next.success"].to_pylist().count(True)
    assert successes == sum(2 if run.winner == "minnows" else 1 for run in runs)


def test_what_is_there_is_not_written_over(made: tuple[Path, list[vrg.Run]]) -> None:
    place, runs = made
    done = invoke("run", "export", str(runs[0].path), "--lerobot", "--output", str(place))
    assert "exists already" in str(done.exception)


@pytest.mark.skipif(importlib.util.find_spec("lerobot") is None, reason="LeRobot is not installed")
def test_lerobot_reads_it(made: tuple[Path, list[vrg.Run]]) -> None:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset  # noqa: PLC0415 - it is large

    place, _ = made
    found = LeRobotDataset("vrg/tiny", root=place)
    assert (found.num_episodes, found.fps) == (3 * RUNS, 10)
    first = found[0]
    assert first["task"].startswith("play sharks-and-minnows as")
    assert first["action"].shape == (2,)
