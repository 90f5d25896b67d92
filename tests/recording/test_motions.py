"""What a recording tells of how robots moved and stood, although it holds only some of the world's ticks."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Message
from vrg.bus.node import Tick
from vrg.bus.topics import Keys, Topic
from vrg.recording.reader import motions_of
from vrg.recording.recorded import read_recorded
from vrg.recording.recorder import Recorder
from vrg.recording.stops import Rest, Trajectory
from vrg.types import LEVEL, Pose, Twist

KEYS = Keys("test")
TICK = 0.02


class World:
    """Says at each tick where `ann` is; the recorder hears every fifth of them, as it does in a match.

    Args:
        path: the recording. speed: of ann at a match time, m/s.
    """

    def __init__(self, path: Path, speed: Callable[[float], float], *, physical: bool = False) -> None:
        self.recorder = Recorder("recorder", Mailbox(), KEYS, path)
        self._speed = speed
        self._physical = physical
        self.x, self.z = 0.0, 0.0
        self.rest: float | None = 0.0
        self.epoch = 0
        self.number = 0

    def play(
        self, begin: float, end: float, *, deaf: tuple[float, float] = (0.0, 0.0), unmeasured: bool = False
    ) -> "World":
        """Let the world tick.

        Args:
            deaf: the recorder hears nothing from the one time to the other, s.
            unmeasured: ann, which is at rest, is not measured after `begin`; of then on its rest is counted anew.
        """
        for tick in range(round(begin / TICK), round(end / TICK)):
            time = round(tick * TICK, 6)
            v, climb = self._speed(time), -0.3 if self.z > 0.0 and time >= 2.0 else LEVEL
            self.x, self.z = self.x + v * TICK, max(0.0, self.z + climb * TICK)
            twist = Twist(v, 0.0, climb=climb)
            self.rest = None if not m.at_rest(twist) else self.rest if self.rest is not None else time
            age = time - begin if unmeasured else 0.0
            self.rest = None if unmeasured else self.rest
            if tick % 5 == 0 and not deaf[0] <= time < deaf[1]:
                body = m.Body("ann", Pose(self.x, 0.0, 0.0, self.z or LEVEL), twist, self._physical, age, self.rest)
                self.say(KEYS.poses, m.Poses(bodies=(body,)), time)
                self.say(KEYS.clock, m.Clock(time=time, tick=tick, epoch=self.epoch, rate=1.0, estop=False), time)
                self.recorder.mailbox.handover(time)
                self.recorder.tick(Tick(time))
        return self

    def say(self, topic: Topic[Message], body: Message, stamp: float) -> None:
        """Let the recorder hear a message at its next tick."""
        self.number += 1
        for inlet in self.recorder.mailbox.inlets:
            if inlet.topic.key == topic.key:
                inlet.offer(Received(topic.key, stamp, self.number, body))


def motion_of(world: World) -> Trajectory:
    world.recorder.stop()
    assert world.recorder.path is not None
    return motions_of(read_recorded(world.recorder.path))["ann"]


def until(stop: float, again: float = math.inf) -> Callable[[float], float]:
    """The speed of a robot that moves, stands from one time on, and moves again from another one on."""
    return lambda time: 1.0 if time < stop or time >= again else 0.0


def test_a_rest_is_known_to_the_tick_at_which_it_began_also_if_nothing_was_heard_then(tmp_path: Path) -> None:
    motion = motion_of(World(tmp_path / "r.mcap", until(1.34, 2.0)).play(0.0, 3.0))
    assert motion.rests == [Rest(1.34, pytest.approx(2.0, abs=TICK + 1e-9), pytest.approx(TICK))]
    assert len(motion.times) == 30, "only every fifth tick was heard"
    assert motion.place(1.34)[0] == pytest.approx(1.34, abs=TICK)
    deaf = World(tmp_path / "deaf.mcap", until(1.34)).play(0.0, 4.0, deaf=(1.2, 3.0))
    assert motion_of(deaf).rests == [Rest(1.34, math.inf, pytest.approx(TICK))]


def test_what_flies_stands_while_it_lands(tmp_path: Path) -> None:
    world = World(tmp_path / "r.mcap", until(1.34))
    world.z = 0.6
    motion = motion_of(world.play(0.0, 6.0))
    assert motion.rests == [Rest(pytest.approx(1.4), math.inf, pytest.approx(5 * TICK))], (
        "known to a record, not to a tick"
    )


def test_a_motion_that_was_not_heard_at_all_parts_two_rests(tmp_path: Path) -> None:
    speed = lambda time: 1.0 if 1.0 <= time < 1.5 else 0.0  # noqa: E731
    world = World(tmp_path / "r.mcap", speed).play(0.0, 4.0, deaf=(0.9, 2.0))
    first, second = motion_of(world).rests
    assert (first.begin, second.begin, second.end) == (0.0, 1.5, math.inf)
    assert first.end <= 1.5


def test_a_world_that_steps_back_begins_a_rest_anew_and_the_old_one_goes_on(tmp_path: Path) -> None:
    world = World(tmp_path / "r.mcap", until(1.0)).play(0.0, 3.0)
    world.rest = None
    world.play(2.9, 4.0)
    assert [rest.begin for rest in motion_of(world).rests] == [1.0]


def test_a_world_that_was_started_again_during_a_halt_and_counts_rests_anew_has_moved_nobody(tmp_path: Path) -> None:
    world = World(tmp_path / "r.mcap", until(1.0)).play(0.0, 3.0, deaf=(2.5, 3.0))
    world.rest = 3.0
    world.play(3.0, 4.0)
    assert [(rest.begin, rest.end) for rest in motion_of(world).rests] == [(1.0, math.inf)]


def test_a_world_that_was_started_again_does_not_know_when_a_robot_came_to_rest_before(tmp_path: Path) -> None:
    world = World(tmp_path / "r.mcap", until(1.3)).play(0.0, 3.0, deaf=(1.2, 3.0))
    world.epoch, world.rest = 1, None
    [rest] = motion_of(world.play(3.0, 4.0)).rests
    assert (rest.begin, rest.resolution) == (3.0, pytest.approx(3.0 - 1.1)), "since 1.1 s, when it was last heard of"


def test_a_recorder_that_is_started_again_goes_on_with_the_same_rest(tmp_path: Path) -> None:
    world = World(tmp_path / "r.mcap", until(1.0)).play(0.0, 2.0)
    world.recorder.stop()
    world.recorder = Recorder("recorder", Mailbox(), KEYS, tmp_path / "r.mcap")
    world.play(3.0, 4.0)
    world.recorder.stop()
    motion = motions_of(read_recorded([tmp_path / "r.mcap", tmp_path / "r-2.mcap"]))["ann"]
    assert [(rest.begin, rest.end) for rest in motion.rests] == [(1.0, math.inf)]


def test_a_physical_robot_is_known_as_well_as_it_was_measured(tmp_path: Path) -> None:
    [rest] = motion_of(World(tmp_path / "r.mcap", until(1.34), physical=True).play(0.0, 3.0)).rests
    assert rest.begin == 1.34
    assert rest.resolution == pytest.approx(0.04), "from the sample at 1.30 s, the last that showed it moving"


@pytest.mark.parametrize(("way", "rests"), [(0.0, [(1.0, math.inf)]), (0.2, [(1.0, 2.0), (3.0, math.inf)])])
def test_a_physical_robot_that_was_not_measured_for_a_while_has_moved_if_it_is_elsewhere(
    tmp_path: Path, way: float, rests: list[tuple[float, float]]
) -> None:
    world = World(tmp_path / "r.mcap", until(1.0), physical=True).play(0.0, 2.0).play(2.0, 3.0, unmeasured=True)
    world.x += way
    world.play(3.0, 4.0)
    found = [value for rest in motion_of(world).rests for value in (rest.begin, rest.end)]
    assert found == pytest.approx([value for pair in rests for value in pair], abs=0.11)


def test_a_robot_that_was_never_measured_is_known_as_well_as_its_samples(tmp_path: Path) -> None:
    world = World(tmp_path / "r.mcap", until(0.0), physical=True).play(1.34, 3.0, unmeasured=True)
    [rest] = motion_of(world).rests
    assert (rest.begin, rest.resolution) == (pytest.approx(1.4), 0.0)


def test_the_orders_of_the_emergency_stop_are_recorded_with_their_match_time(tmp_path: Path) -> None:
    world = World(tmp_path / "r.mcap", until(1.0)).play(0.0, 1.0)
    world.say(KEYS.estop, m.Estop(by="window", reason="a dog"), 0.94)
    world.play(1.0, 2.0)
    world.say(KEYS.estop_release, m.EstopRelease(by="command"), 0.0)
    world.play(2.0, 3.0)
    world.recorder.stop()
    assert read_recorded(tmp_path / "r.mcap").estops == [
        (0.94, m.Estop(by="window", reason="a dog")),
        (2.0, m.EstopRelease(by="command")),
    ], "a command hears no clock, so that the recorder's own time must do"
