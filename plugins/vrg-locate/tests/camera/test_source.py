"""The node of a camera: from tags in pictures to fixes with the match time of each picture."""

import logging
import math
import time
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from real_box import BOX

from camera.scenes import LENS, looking, sheet_at, tags_on_field
from vrg.bus.node import Tick
from vrg.config.loading import load_match
from vrg.errors import ConfigError
from vrg.geometry import compose
from vrg.hal.sim.config import BodySetup
from vrg.localisation.source import read_source
from vrg.runs.keeping import keep
from vrg.runs.run_folder import RunFolder
from vrg.testing.sources import FakeFeed, SourceBench
from vrg.testing.tiny import TINY
from vrg.types import Pose
from vrg_locate.camera import cv2
from vrg_locate.camera import source as module
from vrg_locate.camera.calibration import CameraFile, FloorTag, LensTable, PlaceTable, camera_text
from vrg_locate.camera.capture import TagSighting
from vrg_locate.camera.detection import Tag
from vrg_locate.camera.field import FieldView
from vrg_locate.camera.source import CameraSource

VIEW = FieldView(LENS, looking((0.2, -1.0, 2.6)), 0.5)
FLOOR = (FloorTag(number=20, x=-0.8, y=-0.4), FloorTag(number=21, x=0.8, y=-0.4), FloorTag(number=22, x=0.8, y=0.6))
TABLE = {
    "source": "camera",
    "camera": "pictures",
    "calibration": "cam.toml",
    "tags": {"ann": {"number": 3, "height": 0.25, "x": 0.1, "heading": 90.0}, "bob": {"number": 4, "height": 0.2}},
}
OFFSET = Pose(0.1, 0.0, math.pi / 2)


class Bench(SourceBench):
    """A camera's node, and what it sees."""

    def __init__(
        self,
        folder: Path,
        table: dict = TABLE,
        robots: tuple[str, ...] = ("ann", "bob"),
        things: tuple[BodySetup, ...] = (),
    ) -> None:
        camera = CameraFile(lens=LensTable.of(LENS, 0.2), place=PlaceTable.of(VIEW.place, VIEW.shift), tags=FLOOR)
        (folder / "cam.toml").write_text(camera_text(camera), encoding="utf-8")
        super().__init__(CameraSource, table, "overhead", *robots, base=folder, things=things)
        self.watch = self.node._stream

    def shows(self, *tags: Tag, ago: float = 0.05, size: tuple[int, int] = LENS.size) -> None:
        self.watch.shown.append(TagSighting(self.now - ago, sorted(tags, key=lambda tag: tag.number), size))


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setattr(module, "TagStream", FakeFeed)
    made = Bench(tmp_path)
    made.tick(0.2)
    return made


def seen(number: int, pose: Pose, height: float, size: float = 0.15) -> Tag:
    """A tag at a pose, as a detector without any error would see it."""
    return Tag(number, VIEW.project(sheet_at(pose, height, (size, size))))


def test_a_robot_is_located_at_the_time_of_the_picture(bench: Bench) -> None:
    truth = Pose(0.4, 0.1, 0.6)
    bench.tick(5.0)
    bench.shows(seen(3, compose(truth, OFFSET), 0.25))
    ((stamp, (fix,)),) = bench.tick()
    assert stamp == pytest.approx(5.2 - 0.05)
    assert fix.robot == "ann"
    assert (fix.pose.x, fix.pose.y, fix.pose.theta) == pytest.approx((0.4, 0.1, 0.6), abs=1e-6)
    assert 1e-4 < fix.position < 0.01
    assert fix.heading is not None
    assert 1e-3 < fix.heading < 0.02
    assert bench.tick() == [], "nothing is published twice"
    assert bench.node.counted() == {"pictures": 1, "fixes": {"ann": 1}, "unknown": {}, "ignored": {}}


def test_a_box_is_located_by_its_tag_as_robots_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "TagStream", FakeFeed)
    table = TABLE | {"tags": TABLE["tags"] | {"box": {"number": 7, "height": 0.2, "size": 0.1}}}
    bench = Bench(tmp_path, table, things=(BOX,))
    bench.tick(5.0)
    bench.shows(seen(7, Pose(0.3, -0.2, 0.8), 0.2, size=0.1), seen(4, Pose(0.0, 0.0, 0.0), 0.2))
    ((_, fixes),) = bench.tick()
    assert [fix.robot for fix in fixes] == ["bob", "box"]
    assert (fixes[1].pose.x, fixes[1].pose.y, fixes[1].pose.theta) == pytest.approx((0.3, -0.2, 0.8), abs=1e-6)


def test_what_is_no_fix_is_counted_and_warned_of_once(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    here = Pose(0.0, 0.0, 0.0)
    for _ in range(3):
        bench.shows(seen(3, here, 0.25), seen(3, Pose(0.5, 0.0, 0.0), 0.25), seen(4, here, 0.2), seen(99, here, 0.0))
        ((_, fixes),) = bench.tick()
        assert [fix.robot for fix in fixes] == ["bob"]
    bench.shows(seen(4, here, 0.2, size=0.1))
    assert bench.tick() == []
    counted = bench.node.counted()
    assert counted["unknown"] == {"99": 3}
    assert counted["ignored"] == {"twice": 6, "size": 1}
    told = [record.getMessage() for record in caplog.records]
    assert told == [
        "overhead: tag 3 of ann is seen twice: is one of them another's?",
        "overhead: tag 99 is seen, which no robot has; robots have 3, 4",
        "overhead: tag 4 of bob seems to be 0.100 m wide, expected 0.150 m: are its height and its size right?",
    ]


def test_tags_on_the_floor_tell_whether_the_camera_has_been_moved(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    robot, right = seen(4, Pose(0.0, 0.0, 0.0), 0.2), [seen(t.number, Pose(t.x, t.y, 0.5), 0.0) for t in FLOOR]
    bench.shows(robot, *right)
    assert len(bench.tick()) == 1
    bench.shows(robot, right[0], right[1], seen(22, Pose(0.2, 0.2, 0.0), 0.0))
    assert len(bench.tick()) == 1, "one of them was pushed away"
    assert not caplog.records
    bench.shows(robot, *(seen(t.number, Pose(t.x + 0.1, t.y, 0.5), 0.0) for t in FLOOR))
    assert bench.tick() == []
    assert "the camera has been moved" in caplog.text
    assert bench.node.counted()["unknown"] == {}


def test_a_camera_that_nothing_checks_claims_less_and_less_and_that_is_said_once(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    robot, floor = seen(4, Pose(0.0, 0.0, 0.0), 0.2), [seen(t.number, Pose(t.x, t.y, 0.5), 0.0) for t in FLOOR]

    def common(*tags: Tag, after: float) -> tuple[float, float]:
        bench.now += after
        bench.shows(robot, *tags)
        ((_, (fix,)),) = bench.tick()
        return fix.common

    assert common(*floor, after=0.0) == (0.0, 0.0)
    assert common(*floor[:2], after=1000.0) == (0.0, 0.0), "two are enough"
    assert common(floor[0], after=4.0)[0] < 0.02
    assert not caplog.records, "robots drive over them"
    for number in range(1, 6):
        share = math.sqrt((4.0 + 120.0 * number) / 3600.0)
        assert common(floor[0], after=120.0) == pytest.approx((0.5 * share, 0.2 * share), rel=0.01)
    (told,) = caplog.records
    assert "fewer than two tags on the floor are seen" in told.getMessage()
    # One of two is elsewhere: that shows nothing of the camera.
    assert common(floor[0], seen(22, Pose(0.2, 0.2, 0.0), 0.0), after=0.0)[0] > 0.1
    assert common(*floor, after=0.0) == (0.0, 0.0)


def test_pictures_that_are_old_or_of_another_size_or_from_before_the_match_or_of_a_faster_one_give_no_fix(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    robot = seen(4, Pose(0.0, 0.0, 0.0), 0.2)
    bench.shows(robot, ago=0.5)
    assert bench.tick() == [], "the match had not begun"
    bench.tick(10.0)
    bench.shows(robot, ago=3.0)
    bench.shows(robot, size=(640, 480))
    assert bench.tick() == []
    assert bench.node.counted()["ignored"] == {"size of pictures": 1}
    bench.shows(robot)
    assert len(bench.tick()) == 1
    bench.shows(robot)
    assert bench.tick(rate=0.0) == []
    assert "the match needs `rate = 1`" in caplog.text


def test_a_camera_that_stops_and_comes_back_is_told_once_each(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        for trouble in ("it has sent no picture for 1 s", "it has sent no picture for 2 s", None, None):
            bench.watch.trouble = trouble
            bench.tick()
    told = [record.getMessage() for record in caplog.records]
    assert told == ["overhead: it has sent no picture for 1 s", "overhead sees again"]


def test_names_that_do_not_fit_together_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "TagStream", FakeFeed)
    bench = Bench(tmp_path, robots=("ann", "zoe"))
    bench.node.start()
    assert bench.watch.running
    assert "no tag is named for zoe" in caplog.text
    assert "nothing that is located here has the name bob" in caplog.text
    bench.tick(5.0)
    bench.shows(seen(4, Pose(0.0, 0.0, 0.0), 0.2))
    assert bench.tick() == []
    assert bench.node.counted()["unknown"] == {}
    bench.node.stop()
    assert not bench.watch.running


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"tags": {}}, "at least 1"),
        ({"tags": {"ann": {"number": 600, "height": 0.1}}}, "less than 587"),
        ({"tags": {"ann": {"number": 3, "height": 0.1}, "bob": {"number": 3, "height": 0.1}}}, "got number 3 for ann"),
        ({"prints": "paper"}, "'opencv' or 'apriltag'"),
        ({"rate": 0.0}, "greater than 0"),
        ({"kamera": 1}, "kamera"),
    ],
)
def test_wrong_settings_are_refused(wrong: dict, words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        read_source(TABLE | wrong)


@pytest.mark.parametrize("prints", ["opencv", "apriltag"])
def test_pictures_of_a_folder_become_fixes(tmp_path: Path, prints: str) -> None:
    """All of it, with threads and the real detector; the tags of AprilTag's own prints are turned by half a turn."""
    rng = np.random.default_rng(2)
    (tmp_path / "pictures").mkdir()
    truths = [Pose(0.1 * number, 0.2, 0.5) for number in range(3)]
    turn = Pose(0.0, 0.0, math.pi if prints == "apriltag" else 0.0)
    for number, truth in enumerate(truths):
        tags = [(3, compose(compose(truth, OFFSET), turn), 0.25)]
        tags += [(t.number, Pose(t.x, t.y, 0.0), 0.0) for t in FLOOR]
        cv2.imwrite(str(tmp_path / "pictures" / f"{number}.png"), tags_on_field(VIEW, tags, 0.15, rng))

    bench = Bench(tmp_path, TABLE | {"prints": prints})
    began = time.monotonic()
    bench.now = began + 1000.0
    bench.node._monotonic = time.monotonic
    bench.node._offset.heard(100.0, began)
    bench.node.start()
    found = []
    while len(found) < 3 and time.monotonic() < began + 60.0:
        time.sleep(0.02)
        bench.node.tick(Tick(100.0))
        found += bench.published()
    bench.node.stop()
    assert [fixes[0].robot for _, fixes in found] == ["ann"] * len(found)
    assert np.diff([stamp for stamp, _ in found]) == pytest.approx(0.1, abs=0.1)
    for (_, (fix,)), truth in zip(found, truths, strict=True):
        assert (fix.pose.x, fix.pose.y, fix.pose.theta) == pytest.approx((truth.x, truth.y, truth.theta), abs=0.01)


def test_a_match_needs_the_calibration_and_keeps_it_with_its_run(tmp_path: Path) -> None:
    source = """[localisation.overhead]
source = "camera"
camera = "pictures"
calibration = "cam.toml"
tags = { ann = { number = 3, height = 0.25 } }
"""
    text = TINY.replace('name = "ann"\n', 'name = "ann"\nlocalisation = "fusion"\n')
    (tmp_path / "tiny.toml").write_text(text.replace("[[players]]", f"{source}[[players]]", 1))
    with pytest.raises(ConfigError, match=r"localisation\.overhead: .*cam\.toml"):
        load_match(tmp_path / "tiny.toml")
    Bench(tmp_path)
    setup, folder = load_match(tmp_path / "tiny.toml"), RunFolder(tmp_path / "run")
    folder.prepare()
    keep(setup, folder)
    assert (folder.path / "cam.toml").read_text() == (tmp_path / "cam.toml").read_text()


def test_what_a_camera_lacks_on_its_machine_is_told_before_a_match(tmp_path: Path) -> None:
    """As `vrg doctor match.toml` does, on the machine where the source runs."""
    Bench(tmp_path)
    kind, settings = read_source(TABLE)
    assert (
        "expected the index of a camera, its device, or a file, found none there"
        in kind.missing_here(settings, tmp_path)[0]
    )
    (tmp_path / "pictures").mkdir()
    for size, words in ((LENS.size, None), ((320, 240), "320 x 240 pixels, but those of its calibration")):
        cv2.imwrite(str(tmp_path / "pictures" / "one.png"), np.zeros((size[1], size[0]), dtype=np.uint8))
        lacks = kind.missing_here(settings, tmp_path)
        assert lacks == [] if words is None else words in lacks[0]
    kind, settings = read_source(TABLE | {"camera": 97})
    assert "camera 97: expected a camera that can be opened" in kind.missing_here(settings, tmp_path)[0]
    (tmp_path / "cam.toml").unlink()
    assert "cam.toml" in kind.missing_here(settings, tmp_path)[0]
