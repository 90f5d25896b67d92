"""A match has one referee, one world, and one process a player."""

import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from vrg.testing.processes.match import MINNOWS, LiveMatch

pytestmark = pytest.mark.system


SECONDS = {
    "a coordinator named 'referee'": ["node", "coordinator", "MATCH"],
    "a world named 'world'": ["node", "world", "MATCH"],
    "a player named 'ann'": ["node", "player", "ann", "MATCH"],
}
"""The commands that start somebody who is there already, all at once: each waits whether the first one is about to end.
"""


def test_a_second_one_is_refused(match: LiveMatch, tmp_path: Path) -> None:
    observer = match.observer
    clock, restarts, epoch = observer.state.clock, match.said().count("started again"), observer.epoch

    def second(whom: str) -> subprocess.CompletedProcess[str]:
        words = [str(match.run.match_file) if word == "MATCH" else word for word in SECONDS[whom]]
        return match.vrg(*words, "--router", match.endpoint, "--run", str(tmp_path / words[1]))

    with ThreadPoolExecutor(len(SECONDS)) as pool:
        ends = dict(zip(SECONDS, pool.map(second, SECONDS), strict=True))
    for whom, done in ends.items():
        assert done.returncode == 1, whom
        assert f"match 'long' already has {whom}" in done.stderr
        assert "stop that process first" in done.stderr
        assert "Traceback" not in done.stderr
    observer.wait_until(lambda: observer.state.clock > clock, "the play clock to go on")
    observer.wait_moving(*MINNOWS)
    assert observer.epoch == epoch
    assert match.said().count("started again") == restarts
