"""Pictures that come from a camera or a file: only new ones count, and what is wrong is told in words."""

import time
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from vrg.errors import ConfigError
from vrg.testing.waiting import wait_until
from vrg_locate import stream
from vrg_locate.camera import capture, cv2
from vrg_locate.camera.capture import PictureStream, TagStream
from vrg_locate.camera.detection import Tag
from vrg_locate.camera.readers import CameraFrame, Reader, VideoReader, Wanted, open_reader, read_picture


class Fake:
    """A camera: `do` says what it does."""

    live = True

    def __init__(self) -> None:
        self.do = "work"
        self.taken = self.closed = 0

    def read(self) -> CameraFrame | None:
        time.sleep(0.005)
        if self.do == "stop":
            return None
        while self.do == "hang":
            time.sleep(0.005)
        if self.do != "freeze":
            self.taken += 1
        return CameraFrame(np.full((4, 4), self.taken % 256, np.uint8), time.monotonic())

    def close(self) -> None:
        self.closed += 1


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture, "SILENCE", 0.3)
    monkeypatch.setattr(stream, "RETRY_PERIOD", 0.05)


def test_only_the_newest_picture_is_handed_over_and_only_once() -> None:
    fake = Fake()
    reading = PictureStream(lambda: fake)
    reading.start()
    wait_until(lambda: fake.taken > 20, "pictures")
    (frame,) = reading.take()
    assert int(frame.picture[0, 0]) > 10
    assert time.monotonic() - frame.time < 5.0
    fake.do = "freeze"
    reading.take(0.1)
    assert reading.take(0.1) == []
    reading.close()
    assert fake.closed == 1


@pytest.mark.parametrize(
    ("what", "words"), [("freeze", "frozen"), ("hang", "no picture for"), ("stop", "no pictures any more")]
)
def test_a_camera_that_stops_is_told_of_gives_nothing_and_comes_back(what: str, words: str) -> None:
    fake = Fake()
    reading = PictureStream(lambda: fake)
    reading.start()
    try:
        wait_until(reading.take, "a picture")
        assert reading.problem() is None
        fake.do = what
        wait_until(lambda: words in (reading.problem() or ""), "it to be told")
        reading.take()
        assert reading.take(0.1) == []
        fake.do = "work"
        wait_until(reading.take, "a picture")
        wait_until(lambda: reading.problem() is None, "the end of the problem")
    finally:
        fake.do = "work"
        reading.close()


def test_a_camera_that_is_missing_is_opened_when_it_is_there() -> None:
    fake, there = Fake(), False

    def opened() -> Reader:
        if not there:
            raise ConfigError("camera 7: expected a camera that can be opened")
        return fake

    reading = PictureStream(opened)
    reading.start()
    wait_until(lambda: "expected a camera" in (reading.problem() or ""), "it to be told")
    there = True
    wait_until(reading.take, "a picture")
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
    reading = PictureStream(lambda: open_reader(".", tmp_path))
    reading.start()
    wait_until(lambda: reading.problem() == "the pictures of the file are over", "the end of the file")
    reading.close()


def test_a_film_is_played_at_its_own_rate(tmp_path: Path) -> None:
    film = cv2.VideoWriter(str(tmp_path / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (64, 48))
    for number in range(10):
        film.write(np.full((48, 64, 3), 20 * number, np.uint8))
    film.release()
    slept: list[float] = []
    reader = VideoReader(str(tmp_path / "film.avi"), sleep=slept.append)
    taken = []
    while (frame := reader.read()) is not None:
        taken.append(frame)
    reader.close()
    assert len(taken) == 10
    assert not reader.live
    assert np.diff([frame.time for frame in taken]) == pytest.approx(0.04, abs=1e-6)
    assert [int(frame.picture[0, 0, 0]) for frame in taken] == pytest.approx([20 * n for n in range(10)], abs=6)


class FakeVideo:
    """OpenCV's camera, whose pictures Linux stamps `age` s before they are read; None if it does not stamp them."""

    age: float | None = 0.05
    asked: ClassVar[dict[int, float]] = {}

    def __init__(self, *_: object) -> None:
        self.asked.clear()

    def isOpened(self) -> bool:  # noqa: N802 - OpenCV's name
        return True

    def set(self, what: int, value: float) -> None:
        self.asked[what] = value

    def get(self, what: int) -> float:
        assert what == cv2.CAP_PROP_POS_MSEC
        return 0.0 if self.age is None else 1000.0 * (time.monotonic() - self.age)

    def read(self) -> tuple[bool, np.ndarray]:
        return True, np.zeros((4, 4, 3), np.uint8)

    def release(self) -> None:
        pass


@pytest.mark.parametrize(("age", "expected"), [(0.05, 0.05), (5.0, 5.0), (None, 0.0), (1e9, 0.0), (-1e9, 0.0)])
def test_a_picture_is_as_old_as_linux_says(monkeypatch: pytest.MonkeyPatch, age: float | None, expected: float) -> None:
    """One that has waited in a queue is old, and must not count as new."""
    monkeypatch.setattr(cv2, "VideoCapture", FakeVideo)
    monkeypatch.setattr(FakeVideo, "age", age)
    reader = open_reader(0, Path(), Wanted((1280, 720), 30.0))
    frame = reader.read()
    assert frame is not None
    assert time.monotonic() - frame.time == pytest.approx(expected, abs=2.0)
    assert frame.time <= time.monotonic() - expected + 0.01
    assert FakeVideo.asked[cv2.CAP_PROP_FRAME_WIDTH] == 1280
    assert FakeVideo.asked[cv2.CAP_PROP_AUTOFOCUS] == 0
    reader.close()


def test_of_the_pictures_that_come_while_tags_are_looked_for_only_the_newest_counts() -> None:
    fake = Fake()
    looked: list[int] = []

    class Slow:
        """Takes as long as five pictures."""

        def detect(self, grey: np.ndarray) -> list[Tag]:
            looked.append(int(grey[0, 0]))
            before = fake.taken
            wait_until(lambda: fake.taken >= before + 5, "pictures")
            return []

    reading = TagStream(lambda: fake, 200.0)
    reading._detector = Slow()  # type: ignore[assignment]
    reading.start()
    wait_until(lambda: len(looked) >= 4, "some pictures that were looked at")
    reading.close()
    assert min(np.diff(looked)) >= 4, "the last one may be on its way"
