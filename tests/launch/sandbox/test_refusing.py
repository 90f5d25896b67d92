"""A player's process on a machine that cannot seal it, and the statistics of players that are not to be trusted."""

from pathlib import Path

import pytest

from vrg.config.loading import load_match
from vrg.errors import SandboxError
from vrg.kinds import PLAYER
from vrg.launch.process import by_hand
from vrg.launch.process_main import serve
from vrg.launch.sandbox import seal
from vrg.runs.result import summary, write_result
from vrg.runs.run_folder import RunFolder
from vrg.testing.processes.match import short_match


def test_a_player_that_cannot_be_sealed_does_not_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = short_match("m").replace('name = "ann"', 'name = "ann"\nstrategy = "ann.py:Ann"')
    (tmp_path / "ann.py").write_text("from pathlib import Path\nPath(__file__).with_name('loaded').touch()\n")
    (tmp_path / "match.toml").write_text(text)
    setup = load_match(tmp_path / "match.toml", sandbox=True)
    monkeypatch.setattr(seal, "missing", lambda: "a sandbox needs Linux: `sandbox = false` goes on without")
    # No router is there: it is not even looked for.
    with pytest.raises(SandboxError, match="a sandbox needs Linux: `sandbox = false` goes on without"):
        serve(by_hand(PLAYER, "ann", "tcp/127.0.0.1:9", run=tmp_path / "run", keys=None), setup)
    assert not (tmp_path / "loaded").exists()


@pytest.mark.parametrize(
    "said",
    ["[" * 100_000, '"' + "x" * 2_000_000 + '"', "no json", "", "7", '{"radio": 5}',
     '{"radio": {"bob": {"lost": "x"}}}', '{"refused": 5}', '{"refused": {"vrg/m/clock": "x"}}'],
)  # fmt: skip
def test_a_result_is_written_whatever_a_player_says_of_itself(tmp_path: Path, said: str) -> None:
    (tmp_path / "match.toml").write_text(short_match("m"))
    setup = load_match(tmp_path / "match.toml")
    folder = RunFolder(tmp_path / "run")
    folder.prepare()
    (folder.logs / "ann.json").write_text(said)
    (folder.logs / "bob.json").write_text('{"ticks": 3, "refused": {"vrg/m/clock": 2, "vrg/m/estop": 1}}')
    (folder.logs / "cid.json").write_text('{"ticks": 4, "refused": {}}')
    result = write_result(setup, folder, None, "interrupted")
    assert set(result["processes"]) == {"bob", "cid"}
    assert result["refused"] == {"bob": {"vrg/m/clock": 2, "vrg/m/estop": 1}}
    assert "3 messages with a wrong key refused" in summary(result)
