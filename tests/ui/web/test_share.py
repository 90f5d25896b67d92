"""A match as one file, and as its evidence has it where nothing was recorded."""

from pathlib import Path

import pytest

import vrg
from vrg.playing.run import Run
from vrg.recording.recorded import read_recorded
from vrg.runs.evidenced import read_evidenced
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY
from vrg.testing.views.browser import SIZES, Visitor, chromium
from vrg.ui.timeline import Timeline
from vrg.ui.web.share import recorded, shared


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    home = tmp_path_factory.mktemp("shared")
    (home / "tiny.toml").write_text(TINY)
    return vrg.play(home / "tiny.toml", runs=home / "runs")


def test_the_evidence_shows_what_was_recorded(run: Run) -> None:
    folder = RunFolder(run.path)
    seen, recorded = Timeline(read_evidenced(folder, run.setup)), Timeline(read_recorded(folder.recordings()))
    assert [mark.call for mark in seen.calls] == [mark.call for mark in recorded.calls]
    assert len(seen.instants) > 100
    for time in seen.instants[5::40]:
        ours, theirs = seen.at(time), recorded.at(time)
        assert (ours.score, ours.stage, ours.round) == (theirs.score, theirs.stage, theirs.round), time
        places = {body.name: body.pose for body in theirs.bodies}
        assert [body.pose.x for body in ours.bodies] == pytest.approx([places[b.name].x for b in ours.bodies], abs=0.02)
        assert {body.name: body.state for body in ours.bodies} == {body.name: body.state for body in theirs.bodies}


def test_a_run_without_a_recording_is_shared_too(run: Run, tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    bare = vrg.play(tmp_path / "tiny.toml", runs=tmp_path / "runs", record=False)
    done = invoke("run", "share", str(bare.path), "--output", str(tmp_path / "match.html"))
    assert (done.exit_code, "kB" in done.output) == (0, True), done.output
    assert (tmp_path / "match.html").stat().st_size < 300_000
    (bare.path / "evidence.bin").unlink()
    assert "expected a recording" in str(invoke("run", "share", str(bare.path)).exception)


def test_what_stands_in_names_and_titles_is_text(run: Run) -> None:
    timeline = Timeline(read_evidenced(RunFolder(run.path), run.setup))
    page = shared(recorded(timeline, "</script><b>", {}), "</title><b>")
    assert "<b>" not in page
    assert page == shared(recorded(timeline, "</script><b>", {}), "</title><b>"), "the same match gives the same file"


@pytest.mark.parametrize("size", [SIZES[1], SIZES[-1]])
def test_a_browser_shows_the_file_without_a_network(run: Run, size: tuple[int, int], tmp_path: Path) -> None:
    (tmp_path / "match.html").write_text(run.html(), encoding="utf-8")
    with chromium() as browser:
        visitor = Visitor(browser, f"{(tmp_path / 'match.html').as_uri()}#t=5.0", size)
        visitor.wait("vrg.match.motion.latest?.time === 5 && vrg.field.view && vrg.match.state")
        assert not visitor.page.evaluate("vrg.replay.playing")
        visitor.page.keyboard.press("End")
        visitor.wait("vrg.replay.time === vrg.replay.end && vrg.match.calls.length === vrg.replay.marks.length")
        tag = visitor.page.locator("#calls li", has_text="is tagged").first
        tag.locator("summary").click()
        assert "at most" in tag.inner_text(), "the number that decided"
        tag.locator("time").click()
        visitor.wait("vrg.replay.time === vrg.replay.marks.find((mark) => mark.text.includes('is tagged')).time")
        visitor.page.keyboard.press("Home")
        visitor.wait("vrg.match.calls.length <= 1 && vrg.match.motion.latest.time === vrg.replay.begin")
        assert visitor.errors == []
