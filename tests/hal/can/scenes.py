"""A robot that drives, in which a fault is planted, and what must come of it: it stands, says why, and recovers."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from tests.hal.can.handling import armed, drive_on, recovers
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.emulated import EmulatedDrive
from vrg.hal.models import robot_model
from vrg.testing.can.bench import PATIENCE, RATIO, STEP, DeviceBench, Drives
from vrg.types import Twist

STANDS = 0.5
"""turn/s below which a motor stands."""
TICKS = 5
"""Steps of the simulation in a tick of the player."""
TRACK, RADIUS = robot_model("P2AT").drivetrain.effective_track, robot_model("P2AT").drivetrain.wheel_radius
AHEAD = Twist(0.33, 0.0)


@dataclass
class Scene:
    """A robot that drives, and the drive of its right wheel, in which a fault is planted."""

    protocol: str
    bench: DeviceBench
    drives: Drives
    mend: list[Callable[[], None]] = field(default_factory=list)

    @property
    def drive(self) -> EmulatedDrive:
        return self.drives.drives[1]

    @property
    def now(self) -> float:
        return self.bench.now

    def wrap(self, target: object, name: str, instead: object) -> None:
        """Let a method do something else until the fault is mended."""
        setattr(target, name, instead)
        self.mend.append(lambda: delattr(target, name))

    @property
    def turning(self) -> float:
        """How fast the wheels truly turn the robot, rad/s."""
        left, right = (drive.motor.velocity / RATIO * math.tau * RADIUS for drive in self.drives.drives)
        return (right - left) / TRACK


Plant = Callable[[Scene], None]


def plug(cut: Callable[[float], bool], *, hears: bool = False, speaks: bool = False) -> Plant:
    """Cut the wires of the drive: `cut` is a function of the s since then; a direction may stay whole."""

    def plant(scene: Scene) -> None:
        drive, began = scene.drive, scene.now
        receive, step = drive.receive, drive.step

        def received(frame: Frame, now: float) -> list[Frame]:
            off = cut(now - began)
            if off and not hears:
                drive._advance(now)
                return []
            answers = receive(frame, now)
            return answers if speaks or not off else []

        def stepped(now: float) -> list[Frame]:
            frames = step(now)
            return frames if speaks or not cut(now - began) else []

        scene.wrap(drive, "receive", received)
        scene.wrap(drive, "step", stepped)

    return plant


def encoder(says: Callable[[float, float, float, float], tuple[float, float]]) -> Plant:
    """Let the encoder say something else: of what it was at the beginning, and of what is."""

    def plant(scene: Scene) -> None:
        drive = scene.drive
        estimates = drive._estimates
        before = estimates()
        scene.wrap(drive, "_estimates", lambda: says(*before, *estimates()))

    return plant


def motor(turns: Callable[[float, float], tuple[float, float]]) -> Plant:
    """Let the motor turn otherwise: by the s that pass and the speed that is asked for, and what it makes of both."""

    def plant(scene: Scene) -> None:
        turn = scene.drive.motor.turn
        scene.wrap(scene.drive.motor, "turn", lambda dt, velocity: turn(*turns(dt, velocity)))

    return plant


@dataclass(frozen=True)
class Case:
    """A fault.

    Args:
        what: its name. protocols: of the drives. plant: lets it happen. words: one of them is in what is reported.
        within: s from then until the robot stands for good. turn: rad by which it may turn meanwhile.
        twist: how it drives before, and `then`: how afterwards.
        refused: these words are reported where it is recovered before it is mended; empty where that is not tried.
    """

    what: str
    protocols: str
    plant: Plant
    words: tuple[str, ...]
    within: float = 1.0
    turn: float = 0.8
    twist: Twist = AHEAD
    then: Twist | None = None
    refused: str = ""


ALL = "odrive cia402 moteus vesc"


@contextmanager
def scene_of(protocol: str) -> Iterator[Scene]:
    """A robot whose drives speak this protocol, not connected yet."""
    with Drives(protocol) as drives, DeviceBench(protocol, supply=[20.0, 25.2]) as bench:
        yield Scene(protocol, bench, drives)


def judge(scene: Scene, case: Case) -> None:
    """Drive, plant the fault, and see that the robot stands, says why, and recovers once it is mended."""
    bench = scene.bench
    armed(bench)
    for _ in range(20):
        drive_on(bench, case.twist)
    assert not bench.trouble
    case.plant(scene)
    began, moved, turned = scene.now, scene.now, 0.0
    while scene.now < began + case.within + 2.0:
        drive_on(bench, case.then or case.twist, 0.0)
        for _ in range(TICKS):
            bench.advance(STEP)
            turned += scene.turning * STEP
            if any(abs(drive.motor.velocity) > STANDS for drive in scene.drives.drives):
                moved = scene.now
    assert any(words in bench.trouble for words in case.words), bench.trouble or "nobody notices"
    assert moved - began <= case.within, f"it stands after {moved - began:.2f} s"
    assert abs(turned) <= case.turn, f"it has turned by {math.degrees(turned):.0f} degrees"
    fault = bench.trouble
    if case.refused:
        bench.recover()
        bench.advance(PATIENCE / 4)
        assert case.refused in bench.trouble, bench.trouble or "it recovers with a drive that is another one"
        fault = bench.trouble
    for mend in scene.mend:
        mend()
    for _ in range(5):
        drive_on(bench)
    assert bench.trouble == fault, "a drive that is well again clears nothing"
    recovers(bench)
