"""Whole matches in which the fusion centre locates robots, virtual ones and such with emulated drives."""

import math
from itertools import pairwise
from pathlib import Path

import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Stage
from vrg.bus.node import Node, Tick
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.geometry import compose, inverse
from vrg.localisation.motion import corrected
from vrg.playing.in_process import Ending
from vrg.runs.run_folder import RunFolder
from vrg.testing import matches
from vrg.testing.matches import calls_of
from vrg.testing.tiny import TINY, TINY_CAN, located
from vrg.types import Pose

BALL = """[[bodies]]
name = "ball"
kind = "ball"
x = 1.0
y = 0.0
radius = 0.1
localisation = "fusion"
"""


class Surveyor(Node):
    """Compares where robots are by the fusion centre with where the world has them, and hears what players report.

    Attributes:
        motions, located: the poses by odometry and by the centre, with their times, by player.
        far: the distances at the times of the estimates, m, by player. faults: what players have reported, with the
            match times, s. fastest: the speed of each robot at those times, m/s.
    """

    kind = "surveyor"

    def __init__(self, setup: MatchSetup) -> None:
        super().__init__("surveyor", Mailbox(), 0.02)
        self._poses = self.mailbox.subscribe(setup.keys.poses)
        self._located = self.mailbox.subscribe(setup.keys.robot_pose())
        self._reports = self.mailbox.subscribe(setup.keys.report())
        self._truth: dict[float, dict[str, tuple[float, float]]] = {}
        self._motions = self.mailbox.subscribe(setup.keys.motion())
        self.motions: dict[str, list[tuple[float, Pose]]] = {}
        self.located: dict[str, dict[float, Pose]] = {}
        self.far: dict[str, list[float]] = {}
        self.faults: list[tuple[float, str]] = []
        self.speeds: list[tuple[float, float]] = []

    def tick(self, tick: Tick) -> None:
        """Compare and note."""
        for poses in self._poses.take():
            self._truth[round(poses.stamp, 3)] = {b.name: (b.pose.x, b.pose.y) for b in poses.body.bodies}
            self.speeds.append((poses.stamp, max(abs(b.twist.v) for b in poses.body.bodies)))
        for pose in self._located.take():
            name, truth = pose.key.split("/")[3], self._truth.get(round(pose.stamp, 3))
            if not pose.body.lost:
                self.located.setdefault(name, {})[pose.stamp] = pose.body.pose
            if truth is not None and not pose.body.lost:
                self.far.setdefault(name, []).append(math.dist(truth[name], (pose.body.pose.x, pose.body.pose.y)))
        for motion in self._motions.take():
            self.motions.setdefault(motion.key.split("/")[3], []).append((motion.stamp, motion.body.odometry))
        self.faults += [(report.stamp, fault) for report in self._reports.take() if (fault := report.body.fault)]


def played(tmp_path: Path, text: str, limit: float = 60.0) -> tuple[Ending, Surveyor, RunFolder]:
    """Play a match to its end, or for `limit` s."""
    setup = matches.written(tmp_path, text)
    surveyor = Surveyor(setup)
    ending, run = matches.played(setup, tmp_path / "run", surveyor, limit=limit, strict=True)
    return ending, surveyor, run


def test_a_match_is_played_by_robots_that_only_the_camera_locates(tmp_path: Path) -> None:
    ending, surveyor, run = played(tmp_path, located(TINY, "shark", "ann", "bob"))
    assert ending.state.stage is Stage.GAME_OVER
    assert set(surveyor.far) == {"shark", "ann", "bob"}
    distances = sorted(far for every in surveyor.far.values() for far in every)
    assert distances[int(0.95 * len(distances))] < 0.02
    (tmp_path / "again").mkdir()
    again = played(tmp_path / "again", located(TINY, "shark", "ann", "bob"))[2]
    assert again.journal.read_bytes() == run.journal.read_bytes()


def test_in_the_dark_robots_stand_and_play_is_halted(tmp_path: Path) -> None:
    text = located(TINY, "shark", "ann", more="dark = [[4.0, 6.0]]\n")
    ending, surveyor, run = played(tmp_path, text, limit=8.0)
    assert ending.state.halted is not None
    assert "shark: it has not been located for 0.5 s" in ending.state.halted
    lost = [(time, fault) for time, fault in surveyor.faults if "it is lost: no source has seen it for" in fault]
    assert 4.4 < lost[0][0] < 4.8
    assert max(speed for time, speed in surveyor.speeds if 3.0 < time < 4.0) > 0.4
    assert max(speed for time, speed in surveyor.speeds if 5.5 < time < 6.5) < 0.01
    assert [fault for time, fault in surveyor.faults if time > 6.6] == [], "the light is on again"
    assert [call.rule for call in calls_of(run)] == ["begin", "halt", "halt"]


def test_robots_with_drives_are_where_the_camera_has_them_not_where_their_odometry_does(tmp_path: Path) -> None:
    more = "[localisation.overhead.errors.ann]\nway = 0.03\nbend = 3.0\n"
    ending, surveyor, _ = played(tmp_path, located(TINY_CAN, "ann", more=more))
    assert ending.state.stage is Stage.GAME_OVER
    truth = believed = Pose(-3.0, 4.0, 0.0)
    far, off = [], []
    for (_, before), (time, after) in pairwise(surveyor.motions["ann"]):
        way = compose(inverse(before), after)
        truth = compose(truth, corrected(way, 0.03, 0.0, math.radians(3.0)))
        believed = compose(believed, way)
        off.append(math.dist((truth.x, truth.y), (believed.x, believed.y)))
        if (pose := surveyor.located["ann"].get(time)) is not None:
            far.append(math.dist((truth.x, truth.y), (pose.x, pose.y)))
    assert len(far) > 50
    assert sorted(far)[int(0.95 * len(far))] < 0.02
    assert max(off) > 0.3, "by its odometry alone it would be far from there"


def test_a_source_of_the_truth_locates_no_real_robot(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="expected a source that sees real robots"):
        matches.written(tmp_path, located(TINY_CAN, "ann").replace("emulate = true\n", ""))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("[localisation.overhead]\n", ""), "players.2.localisation: expected a source of fixes"),
        (('source = "sim"', 'source = "eye"'), "localisation.overhead.source: source of fixes: expected one of"),
        (('source = "sim"', ""), "localisation.overhead.source"),
        (('source = "sim"', 'source = "sim"\nrate = 0'), "localisation.overhead.rate"),
        (('source = "sim"', 'source = "sim"\ndelais = 0.1'), "did you mean 'delay'?"),
        (("[localisation.overhead]", "[localisation.ann]"), "expected a name that no other process of this match has"),
        (('localisation = "fusion"\n', ""), "it locates no player"),
        (
            ("[rules]", BALL + "[rules]"),
            "ball: expected a source that sees real things, such as `ssl`: `sim` sees none",
        ),
    ],
)
def test_mistakes_in_the_match_file_are_told(tmp_path: Path, change: tuple[str, str], words: str) -> None:
    text = located(TINY, "ann").replace(*change)
    if change[0] == "[localisation.overhead]\n":
        text = text.replace('source = "sim"\n', "")
    with pytest.raises(ConfigError) as caught:
        matches.written(tmp_path, text)
    assert words in str(caught.value)
