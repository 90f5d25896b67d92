"""Which match a command means."""

import json
import os
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from vrg.errors import ConfigError
from vrg.launch import registry
from vrg.launch.registry import RunningMatch


@pytest.fixture(autouse=True)
def _own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def running(name: str, router: str = "tcp/127.0.0.1:7447") -> AbstractContextManager[None]:
    return registry.registered(RunningMatch(match=name, router=router, run="runs/x", pid=os.getpid()))


def test_the_only_match_is_meant() -> None:
    with running("final", "tcp/127.0.0.1:9"):
        assert registry.find(None, None, "default") == ("final", "tcp/127.0.0.1:9")
    assert registry.running() == []


def test_of_several_one_must_be_named() -> None:
    with running("one", "tcp/127.0.0.1:1"), running("two", "tcp/127.0.0.1:2"):
        with pytest.raises(ConfigError, match="--match two --router tcp"):
            registry.find(None, None, "default")
        assert registry.find("two", None, "default") == ("two", "tcp/127.0.0.1:2")


def test_a_match_whose_launcher_is_gone_does_not_count_whoever_has_its_pid_now(tmp_path: Path) -> None:
    (tmp_path / "vrg").mkdir()
    entry = {"match": "dead", "router": "tcp/127.0.0.1:7447", "run": "runs/x", "pid": os.getpid()}
    (tmp_path / "vrg" / "dead-1.json").write_text(json.dumps(entry))
    with pytest.raises(ConfigError, match="no match runs"):
        registry.find(None, None, "default")


def test_a_match_on_another_machine_is_named_by_its_address() -> None:
    assert registry.find("far", "tcp/192.0.2.1:7447", "default") == ("far", "tcp/192.0.2.1:7447")
    assert registry.find("far", None, "default") == ("far", "default")


def test_a_damaged_entry_is_ignored(tmp_path: Path) -> None:
    with running("final"):
        (tmp_path / "vrg" / "junk.json").write_text("{")
        assert [m.match for m in registry.running()] == ["final"]


def test_a_folder_that_cannot_be_written_does_not_keep_a_match_from_being_played(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "vrg").write_text("not a folder")
    with running("final"):
        assert registry.running() == []
    assert "will not find this match" in caplog.text
