"""What somebody sees who watches a match, as numbers."""

import math
from pathlib import Path

from vrg.config.loading import load_match
from vrg.launch.nodes.referee import open_journal
from vrg.playing import in_process
from vrg.runs.run_folder import RunFolder
from vrg.testing.audience import MatchWatcher
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY


def test_an_audience_counts_what_it_sees_until_the_end(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    setup, folder = load_match(tmp_path / "tiny.toml").at_rate(0.0), RunFolder(tmp_path / "run")
    folder.prepare()
    audience = MatchWatcher(setup, ignored=("begin",))
    with open_journal(setup, folder) as journal:
        ending = in_process.play(setup, journal, watchers=[audience])
    seen = audience.seen
    assert seen.over
    assert seen.winner == ending.state.winner
    assert seen.first("begin") == math.inf
    assert seen.first("pass_over") <= seen.first("game_over") <= seen.length <= ending.time
    assert seen.count("game_over") == 1
    assert 0.0 < seen.still < seen.length
    assert seen.quiet <= seen.length


def test_after_a_match_the_next_commands_are_printed_with_its_run(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    done = invoke("play", str(tmp_path / "tiny.toml"), "--in-process", "--headless", "--runs", str(tmp_path / "runs"))
    (run,) = (tmp_path / "runs").iterdir()
    lines = done.stdout.partition("Next:\n")[2].splitlines()
    assert [line.split()[1:4] for line in lines] == [["run", "why", str(run)], ["run", "replay", str(run)],
                                                     ["practice", "drive", "a"]]  # fmt: skip
