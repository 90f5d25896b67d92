"""A match has one referee, one world, and one process a player."""

from pathlib import Path

import pytest

from tests.system.harness import Match

pytestmark = pytest.mark.system


@pytest.mark.parametrize(
    ("command", "whom"),
    [
        (["coordinator", "MATCH"], "a coordinator named 'referee'"),
        (["world", "MATCH"], "a world named 'world'"),
        (["player", "MATCH", "ann"], "a player named 'ann'"),
    ],
    ids=["coordinator", "world", "player"],
)
def test_a_second_one_is_refused(match: Match, tmp_path: Path, command: list[str], whom: str) -> None:
    observer = match.observer
    clock, restarts, epoch = observer.state.clock, match.said().count("started again"), observer.epoch
    arguments = [str(match.run.match_file) if word == "MATCH" else word for word in command]
    done = match.vrg(*arguments, "--router", match.endpoint, "--run", str(tmp_path / "other"))
    assert done.returncode == 1
    assert f"match 'long' already has {whom}" in done.stderr
    assert "stop that process first" in done.stderr
    assert "Traceback" not in done.stderr
    observer.wait_until(lambda: observer.state.clock > clock, "the clock to go on")
    assert observer.playing
    assert observer.epoch == epoch
    assert match.said().count("started again") == restarts


def test_a_second_coordinator_of_the_same_run_folder_is_refused(match: Match) -> None:
    """Its journal is locked, whatever router the second one asks."""
    done = match.vrg("coordinator", str(match.run.match_file), "--router", match.endpoint, "--run", str(match.run.path))
    assert done.returncode == 1
    assert "another coordinator is writing it" in done.stderr
    assert match.observer.playing
