"""Which match a command means."""

import json
import os
import socket
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vrg.errors import ConfigError
from vrg.launch import running
from vrg.launch.running import RunningMatch


@pytest.fixture(autouse=True)
def _own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def listed(name: str, router: str = "tcp/127.0.0.1:7447") -> AbstractContextManager[None]:
    return running.registered(RunningMatch(match=name, router=router, run="runs/x", pid=os.getpid()))


def test_the_only_match_is_meant() -> None:
    with listed("final", "tcp/127.0.0.1:9"):
        assert running.find(None, None, "default") == ("final", "tcp/127.0.0.1:9")
    assert running.running() == []


def test_of_several_one_must_be_named() -> None:
    with listed("one", "tcp/127.0.0.1:1"), listed("two", "tcp/127.0.0.1:2"):
        with pytest.raises(ConfigError, match="two --router tcp"):
            running.find(None, None, "default")
        assert running.find("two", None, "default") == ("two", "tcp/127.0.0.1:2")


def test_a_match_whose_launcher_is_gone_does_not_count_whoever_has_its_pid_now(tmp_path: Path) -> None:
    (tmp_path / "vrg").mkdir()
    entry = {"match": "dead", "router": "tcp/127.0.0.1:7447", "run": "runs/x", "pid": os.getpid()}
    (tmp_path / "vrg" / "dead-1.json").write_text(json.dumps(entry))
    with pytest.raises(ConfigError, match="no match runs"):
        running.find(None, None, "default")


def test_a_match_on_another_machine_is_named_by_its_address() -> None:
    assert running.find("far", "tcp/192.0.2.1:7447", "default") == ("far", "tcp/192.0.2.1:7447")


def test_a_match_that_is_not_listed_may_be_at_the_usual_router_if_there_is_one() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        usual = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        assert running.find("far", None, usual) == ("far", usual)
        tls = usual.replace("tcp", "tls")
        with listed("near", tls), pytest.raises(ConfigError, match=r"\(near\), got 'far'; name the router"):
            running.find("far", None, usual)
    with listed("near"), pytest.raises(ConfigError, match=r"runs on this machine \(near\), got 'far'; name the router"):
        running.find("far", None, usual)


def test_whose_match_it_is_tells_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    match = RunningMatch(match="m", router="r", run="x", pid=1, folder=str(tmp_path / "ann"))
    for folder, own in ((tmp_path / "ann" / "deep", True), (tmp_path / "bob", False), (tmp_path, True)):
        folder.mkdir(parents=True, exist_ok=True)
        monkeypatch.chdir(folder)
        assert match.is_own is own


def test_a_damaged_entry_is_ignored(tmp_path: Path) -> None:
    with listed("final"):
        (tmp_path / "vrg" / "junk.json").write_text("{")
        assert [m.match for m in running.running()] == ["final"]


def test_an_entry_is_not_seen_before_it_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = json.dump

    def watched(*arguments: Any) -> None:
        write(*arguments)
        assert list(tmp_path.rglob("*.json")) == []

    monkeypatch.setattr(json, "dump", watched)
    with listed("final"):
        assert [m.match for m in running.running()] == ["final"]


def test_a_folder_that_cannot_be_written_keeps_no_match_back(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "vrg").write_text("not a folder")
    with listed("final"):
        assert running.running() == []
    assert "will not find this match" in caplog.text


def test_what_shows_a_match_of_this_machine_ends_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "LOOK", 0.0)
    match = RunningMatch("m", "tcp/127.0.0.1:1", str(tmp_path), os.getpid())
    with running.registered(match):
        has_ended = running.gone(match.match, match.router)
        elsewhere = running.gone("other", match.router)
        assert not has_ended()
    with running.registered(replace(match, pid=match.pid + 1)):
        assert has_ended(), "another match of that name has begun there"
    assert not elsewhere()
