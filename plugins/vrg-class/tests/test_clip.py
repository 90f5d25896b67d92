"""A clip of a call is a picture that moves."""

from pathlib import Path

from PIL import Image

import vrg
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY


def test_the_seconds_around_a_call_become_a_picture_that_moves(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    run = vrg.play(tmp_path / "tiny.toml", runs=tmp_path / "runs")
    tag = next(call for call in run.calls if call.rule == "tag")
    command = ("run", "clip", str(run.path), "--call", str(tag.number))
    done = invoke(*command, "--before", "1", "--after", "0.6", "--width", "320")
    assert done.exit_code == 0, done.output
    assert "is tagged" in done.output
    with Image.open(run.path / f"call-{tag.number}.gif") as picture:
        assert (picture.size, picture.n_frames) == ((320, 200), 21)
        assert picture.info["duration"] == 80
        first = picture.convert("RGB").tobytes()
        picture.seek(20)
        assert picture.convert("RGB").tobytes() != first
    assert "expected the number of a call" in str(invoke("run", "clip", str(run.path), "--call", "99").exception)
