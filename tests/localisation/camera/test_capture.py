"""Pictures that come from a camera or a file: only new ones count, and what is wrong is told in words."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from vrg.errors import ConfigError
from vrg.localisation.camera import capture
from vrg.localisation.camera.capture import Capture, Frame, Reader, open_reader, read_picture
from vrg.localisation.camera.opencv import cv2


def eventually(holds: Callable[[], object], seconds: float = 20.0) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if holds():
            return True
        time.sleep(0.005)
    return False


class Fake:
    """A camera: `do` says what it does."""

    live = True

    def __init__(self) -> None:
        self.do = "work"
        self.taken = self.closed = 0

    def read(self) -> Frame | None:
        time.sleep(0.005)
        if self.do == "stop":
            return None
        while self.do == "hang":
            time.sleep(0.005)
        if self.do != "freeze":
            self.taken += 1
        return Frame(np.full((4, 4), self.taken % 256, np.uint8), time.monotonic())

    def close(self) -> None:
        self.closed += 1


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture, "SILENT", 0.3)
    monkeypatch.setattr(capture, "_AGAIN", 0.05)


def test_only_the_newest_picture_is_handed_over_and_only_once() -> None:
    fake = Fake()
    reading = Capture(lambda: fake)
    reading.start()
    assert eventually(lambda: fake.taken > 20)
    frame = reading.newest()
    assert frame is not None
    assert int(frame.picture[0, 0]) > 10
    assert time.monotonic() - frame.time < 5.0
    fake.do = "freeze"
    reading.newest(0.1)
    assert reading.newest(0.1) is None
    reading.close()
    assert fake.closed == 1


@pytest.mark.parametrize(
    ("what", "words"), [("freeze", "frozen"), ("hang", "no picture for"), ("stop", "no pictures any more")]
)
def test_a_camera_that_stops_is_told_of_gives_nothing_and_comes_back(what: str, words: str) -> None:
    fake = Fake()
    reading = Capture(lambda: fake)
    reading.start()
    try:
        assert eventually(lambda: reading.newest() is not None)
        assert reading.problem() is None
        fake.do = what
        assert eventually(lambda: words in (reading.problem() or "")), reading.problem()
        reading.newest()
        assert reading.newest(0.1) is None
        fake.do = "work"
        assert eventually(lambda: reading.newest() is not None)
        assert eventually(lambda: reading.problem() is None)
    finally:
        fake.do = "work"
        reading.close()


def test_a_camera_that_is_missing_is_opened_when_it_is_there() -> None:
    fake, there = Fake(), False

    def opened() -> Reader:
        if not there:
            raise ConfigError("camera 7: expected a camera that can be opened")
        return fake

    reading = Capture(opened)
    reading.start()
    assert eventually(lambda: "expected a camera" in (reading.problem() or ""))
    there = True
    assert eventually(lambda: reading.newest() is not None)
    assert reading.problem() is None
    reading.close()


@pytest.mark.parametrize("camera", [97, "/dev/video97"])
def test_a_camera_that_does_not_exist_is_told(camera: int | str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"97: expected a camera that can be opened; there are"):
        open_reader(camera, tmp_path)


def test_a_file_that_does_not_exist_or_holds_no_pictures_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.avi: expected the index of a camera, its device, or a file"):
        open_reader("none.avi", tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigError, match="expected pictures in this folder"):
        open_reader("empty", tmp_path)
    (tmp_path / "film.avi").write_bytes(b"no film")
    with pytest.raises(ConfigError, match=r"film\.avi: expected a video file that can be opened"):
        open_reader("film.avi", tmp_path)
    (tmp_path / "empty" / "a.png").write_bytes(b"no picture")
    with pytest.raises(ConfigError, match=r"a\.png: expected a picture such as PNG"):
        read_picture(tmp_path / "empty" / "a.png")
    with pytest.raises(ConfigError, match="expected a picture"):
        read_picture(tmp_path / "nowhere.png")


def test_a_folder_is_read_in_order_and_then_is_over(tmp_path: Path) -> None:
    for number in range(3):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((8, 8), 40 * number, np.uint8))
    (tmp_path / "notes.txt").write_text("no picture")
    reader = open_reader(".", tmp_path)
    taken = [frame for frame in (reader.read() for _ in range(4)) if frame is not None]
    assert [int(frame.picture[0, 0, 0]) for frame in taken] == [0, 40, 80]
    assert np.diff([frame.time for frame in taken]) == pytest.approx(0.1, abs=0.1)
    reading = Capture(lambda: open_reader(".", tmp_path))
    reading.start()
    assert eventually(lambda: reading.problem() == "the pictures of the file are over")
    reading.close()


def test_a_film_is_played_at_its_own_rate(tmp_path: Path) -> None:
    film = cv2.VideoWriter(str(tmp_path / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (64, 48))
    for number in range(10):
        film.write(np.full((48, 64, 3), 20 * number, np.uint8))
    film.release()
    slept: list[float] = []
    reader = capture.VideoReader(str(tmp_path / "film.avi"), sleep=slept.append)
    taken = []
    while (frame := reader.read()) is not None:
        taken.append(frame)
    reader.close()
    assert len(taken) == 10
    assert not reader.live
    assert np.diff([frame.time for frame in taken]) == pytest.approx(0.04, abs=1e-6)
    assert [int(frame.picture[0, 0, 0]) for frame in taken] == pytest.approx([20 * n for n in range(10)], abs=6)
