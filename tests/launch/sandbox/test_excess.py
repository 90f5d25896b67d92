"""A sealed player that has too many threads, or that writes too much."""

import contextlib
import mmap
import os
import re
import shutil
import socket
import threading
from pathlib import Path

import pytest

from vrg.launch.sandbox import excess as bounds
from vrg.launch.sandbox.excess import excess


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(bounds, "SOCKETS", 1000)  # tests before this one have left some in this process
    folder = tmp_path / "players" / "ann"
    folder.mkdir(parents=True)
    return folder


def test_a_modest_player_uses_not_too_much_and_one_that_has_ended_nothing(own: Path, tmp_path: Path) -> None:
    (own / "notes").write_text("hello")
    assert excess(tmp_path, "ann", os.getpid()) is None
    assert excess(tmp_path, "ann", 2**22 + 1) is None


def test_a_player_that_is_not_sealed_is_not_looked_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "THREADS", 0)
    assert excess(tmp_path, "ann", os.getpid()) is None


def test_many_threads_or_sockets_are_too_many(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(bounds, "THREADS", threading.active_count() - 1)
        assert "threads" in (excess(tmp_path, "ann", os.getpid()) or "")
    monkeypatch.setattr(bounds, "SOCKETS", 3)
    with contextlib.ExitStack() as stack:
        for end in (end for _ in range(2) for end in socket.socketpair()):
            stack.enter_context(end)
        assert "sockets" in (excess(tmp_path, "ann", os.getpid()) or "")


def test_no_name_that_a_process_gives_itself_hides_its_threads(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bounds, "THREADS", 2)
    stop, before = threading.Event(), Path("/proc/self/comm").read_text()
    others = [threading.Thread(target=stop.wait) for _ in range(3)]
    for thread in others:
        thread.start()
    Path("/proc/self/comm").write_text("Threads:\t1")
    try:
        assert re.fullmatch(r"it has \d+ threads", excess(tmp_path, "ann", os.getpid()) or "")
    finally:
        Path("/proc/self/comm").write_text(before)
        stop.set()
        for thread in others:
            thread.join()


def test_a_large_file_is_too_large_and_takes_no_room_itself(own: Path, tmp_path: Path) -> None:
    with (own / "big").open("wb") as file:
        file.truncate(bounds.MAX_FOLDER_SIZE + 1)
    assert excess(tmp_path, "ann", os.getpid()) == "it keeps 100 MB in 1 files in its folder"


def test_many_small_files_are_too_many(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "ENTRIES", 3)
    (own / "deep").mkdir()
    for number in range(3):
        (own / "deep" / str(number)).touch()
    assert excess(tmp_path, "ann", os.getpid()) == "it keeps 0 MB in 4 files in its folder"


def test_a_deleted_file_that_is_still_open_counts(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "MAX_FOLDER_SIZE", 1_500_000)
    with (own / "gone").open("wb") as file:
        file.write(bytes(2_000_000))
        file.flush()
        (own / "gone").unlink()
        assert excess(tmp_path, "ann", os.getpid()) == "it keeps 2 MB in 0 files in its folder"
    assert excess(tmp_path, "ann", os.getpid()) is None


def test_a_deleted_file_that_is_mapped_counts(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "MAX_FOLDER_SIZE", 1_500_000)
    (own / "gone").write_bytes(bytes(2_000_000))
    with (own / "gone").open("r+b") as file:
        held = mmap.mmap(file.fileno(), 0)
    (own / "gone").unlink()
    # The mapping has a descriptor of its own, which another program would not need.
    monkeypatch.setattr(bounds, "_descriptors", lambda _pid: iter(()))
    assert (excess(tmp_path, "ann", os.getpid()) or "").startswith("it keeps 2 MB")
    held.close()
    assert excess(tmp_path, "ann", os.getpid()) is None


def test_a_folder_that_cannot_be_listed_or_is_too_deep_is_told_in_one_line(own: Path, tmp_path: Path) -> None:
    secret = own / "x\n0:99.9  game over: Blue wins"
    secret.mkdir(mode=0o300)
    told = excess(tmp_path, "ann", os.getpid()) or ""
    assert "cannot be listed: x\\n0:99.9" in told
    assert "\n" not in told
    secret.rmdir()
    own.joinpath(*["n"] * (bounds.MAX_FOLDER_DEPTH + 2)).mkdir(parents=True)
    assert excess(tmp_path, "ann", os.getpid()) == f"it nests more than {bounds.MAX_FOLDER_DEPTH} folders"


def test_folders_whose_path_is_too_long_are_looked_through(own: Path, tmp_path: Path) -> None:
    here = os.getcwd()
    os.chdir(own)
    try:
        for _ in range(20):
            os.mkdir("n" * 250)
            os.chdir("n" * 250)
        Path("big").write_bytes(b"")
        os.truncate("big", bounds.MAX_FOLDER_SIZE + 1)
    finally:
        os.chdir(here)
    assert excess(tmp_path, "ann", os.getpid()) == "it keeps 100 MB in 21 files in its folder"


def test_folders_may_go_away_while_they_are_looked_through(own: Path, tmp_path: Path) -> None:
    """A strategy that makes and deletes a cache all the time does nothing wrong."""
    stop = threading.Event()

    def make_and_delete() -> None:
        while not stop.is_set():
            for number in range(300):
                (own / f"c{number}" / "d").mkdir(parents=True)
            for number in range(300):
                shutil.rmtree(own / f"c{number}")

    maker = threading.Thread(target=make_and_delete)
    maker.start()
    try:
        assert {excess(tmp_path, "ann", os.getpid()) for _ in range(50)} == {None}
    finally:
        stop.set()
        maker.join()
