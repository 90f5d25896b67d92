"""Robots of the CAN benchmark: real drive trains and emulated drives, in this process and in others.

`can.py --process` is one of the others: `drives NODE...` is those drives, noting their true speeds at each step;
`command TRAINS MOTORS RATE SECONDS [OPTION...]` drives so many robots of so many motors, nodes from 0 on, until it is
killed if SECONDS is 0. Options are `no-gc` and `switch=SECONDS`, of the interpreter's.
"""

import contextlib
import gc
import json
import math
import os
import random
import struct
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from can_peers import CHANNEL, Peer

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.errors import RobotError
from vrg.hal.backends import MatchContext, open_driver
from vrg.hal.can.base import WheelAxis
from vrg.hal.can.bus import RealMedium
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.train import DriveTrain
from vrg.hal.can.workshop.emulated import DriveOptions, EmulatedDrive
from vrg.hal.can.workshop.run import run_drives
from vrg.hal.device import Device
from vrg.hal.models import robot_model
from vrg.types import Twist

PROCESS = (str(Path(__file__).with_name("can.py")), "--process")
PROTOCOL = PROTOCOLS.get("odrive")
MODEL = robot_model("P2AT")
RATIO = 50.0
SPEED = 5.0
"""rad/s of the wheels, 0.55 m/s: 40 turn/s of a motor."""
AHEAD = Twist(SPEED * MODEL.drivetrain.wheel_radius, 0.0)
"""The same of the body."""
ZERO = 0.5
"""turn/s of a motor below which it stands: 1 cm/s of the wheel."""
PLAYER_RATE = 10.0
"""Hz of a player's decisions."""
PATIENCE = 60.0
_NOTE = struct.Struct("<qid")


def train(name: str, nodes: Sequence[int]) -> DriveTrain:
    """A drive train, the first half of its motors on the left."""
    axes = [WheelAxis(node, axis=int(i >= len(nodes) / 2), ratio=RATIO) for i, node in enumerate(nodes)]
    return DriveTrain(name, RealMedium(), Link(channel=CHANNEL), PROTOCOL, axes, MODEL)


def robot(left: int, right: int) -> Device:
    """The same by the backend, in the device that a player has."""
    table = {"left": [left], "right": [right], "ratio": RATIO}
    keys, mailbox = Keys("benchmark"), Mailbox()
    context = MatchContext(
        name="r",
        model=MODEL,
        options={"channel": CHANNEL, "protocol": PROTOCOL.name, "robots": {"r": table}},
        keys=keys,
        mailbox=mailbox,
    )
    return Device(open_driver("can", context), keys, mailbox)


def play(one: Device) -> None:
    """Take in what the match has said, then drive, as a player does at each tick."""
    one.hear()
    one.drive(AHEAD)


def arm(trains: Sequence[DriveTrain]) -> None:
    """Arm robots, and wait until all of them obey."""
    deadline = time.monotonic() + PATIENCE
    while not all(one.state().armed for one in trains):
        if time.monotonic() > deadline:
            raise TimeoutError(f"not armed within {PATIENCE:g} s: {[one.state() for one in trains]}")
        for one in trains:
            _ready(one)
            one.stop()
        time.sleep(0.02)


def keep_driving(one: DriveTrain, twist: Twist) -> bool:
    """Drive as a player does, which arms again at its next turn where the robot refuses; return whether it drove."""
    try:
        one.drive(twist)
    except RobotError:
        _ready(one)
        return False
    return True


def _ready(one: DriveTrain) -> None:
    """Let a robot recover that this computer was too busy for, and arm it, as far as it can be."""
    if one.state().fault:
        one.recover()
    with contextlib.suppress(RobotError):
        one.arm()


@contextlib.contextmanager
def connected(*trains: DriveTrain) -> Iterator[None]:
    """Connected and armed."""
    try:
        for one in trains:
            one.connect()
        arm(trains)
        yield
    finally:
        for one in trains:
            one.close()


@contextlib.contextmanager
def connected_robot(one: Device) -> Iterator[None]:
    """The same of a robot by the backend."""
    try:
        one.start()
        deadline = time.monotonic() + PATIENCE
        while not one.read().armed:
            if time.monotonic() > deadline:
                raise TimeoutError(f"not armed within {PATIENCE:g} s: {one.read()}")
            with contextlib.suppress(RobotError):
                one.arm()
            one.stop()
            time.sleep(0.02)
        yield
    finally:
        one.close()


def paced(rate: float, seconds: float) -> Iterator[float]:
    """Yields `rate` times a second how late it is, s, for `seconds`; a time that was missed does not come again."""
    began = time.monotonic()
    number, count = 0, seconds * rate
    while number < count:
        late = time.monotonic() - began - number / rate
        if late < 0:
            time.sleep(-late)
            continue
        yield late
        number = max(number + 1, math.ceil((time.monotonic() - began) * rate - 0.5))
    time.sleep(max(0.0, began + seconds - time.monotonic()))


@dataclass(frozen=True, slots=True)
class Speed:
    """What a motor's speed really was: s of time.time(); turn/s."""

    at: float
    node: int
    velocity: float


class Drives(Peer):
    """Emulated drives in a process of their own; see `Peer`."""

    def __init__(self, nodes: Sequence[int]) -> None:
        super().__init__([*PROCESS, "drives", *map(str, nodes)])
        self.nodes = list(nodes)

    def __enter__(self) -> "Drives":
        super().__enter__()
        return self

    def take(self) -> list[Speed]:
        """The speeds since the last call, every 10 ms."""
        self.ask()
        (count,) = struct.unpack("<I", self.read(4))
        notes = self.read(count * _NOTE.size) if count else b""
        return [Speed(at * 1e-9, node, velocity) for at, node, velocity in _NOTE.iter_unpack(notes)]

    def stopped(self, speeds: Sequence[Speed], since: float) -> float | None:
        """s from `since` until the last of the motors stood; None if one of them did not turn before.

        Raises:
            RuntimeError: one still turns.
        """
        took = 0.0
        for node in self.nodes:
            own = [speed for speed in speeds if speed.node == node]
            before = [speed for speed in own if speed.at <= since]
            turning = [i for i, speed in enumerate(own) if abs(speed.velocity) >= ZERO]
            if not before or abs(before[-1].velocity) < ZERO:
                return None
            if turning[-1] + 1 == len(own):
                raise RuntimeError(f"node {node} did not stop")
            took = max(took, own[turning[-1] + 1].at - since)
        return took


def commander(trains: int, motors: int, rate: float, seconds: float = 0.0, *options: str) -> Peer:
    """Another process that commands."""
    return Peer([*PROCESS, "command", str(trains), str(motors), str(rate), str(seconds), *options])


class _Watched:
    """A drive that notes its speed at each step, silent or not."""

    def __init__(self, drive: EmulatedDrive, notes: list[tuple[int, int, float]]) -> None:
        self._drive = drive
        self._notes = notes
        self.receive = drive.receive

    @property
    def due(self) -> float:
        return self._drive.due

    def step(self, now: float) -> list[Frame]:
        frames = self._drive.step(now)
        self._notes.append((time.time_ns(), self._drive.node, self._drive.motor.velocity))
        return frames


def _drives(nodes: Sequence[int]) -> None:
    stop = threading.Event()
    notes: list[tuple[int, int, float]] = []
    now = time.monotonic()
    drives = [
        _Watched(PROTOCOL.drive_type(node, DriveOptions(serial=0x1000 + node), now, random.Random(node)), notes)
        for node in nodes
    ]

    def answer() -> None:
        while os.read(0, 1):
            count = len(notes)
            packed = b"".join(_NOTE.pack(*note) for note in notes[:count])
            del notes[:count]
            sys.stdout.buffer.write(struct.pack("<I", count) + packed)
            sys.stdout.buffer.flush()
        stop.set()

    threading.Thread(target=answer, daemon=True).start()
    run_drives(Link(channel=CHANNEL), drives, stop, ready=lambda: print("ready", flush=True))  # type: ignore[arg-type]


def _command(count: int, motors: int, rate: float, seconds: float) -> None:
    trains = [train(f"r{i + 1}", range(i * motors, (i + 1) * motors)) for i in range(count)]
    print("started", flush=True)
    with connected(*trains):
        print(f"driving {time.time_ns()}", flush=True)
        lates, tooks, refused = [], [], 0
        collected: list[float] = []

        def note(phase: str, _info: dict[str, int]) -> None:
            """The garbage collector begins or ends."""
            collected.append(time.monotonic() if phase == "start" else time.monotonic() - collected.pop())

        gc.callbacks.append(note)
        cpu, wall = time.process_time(), time.monotonic()
        for late in paced(rate, seconds or math.inf):
            began = time.monotonic()
            for one in trains:
                refused += not keep_driving(one, AHEAD)
            lates.append(late)
            tooks.append(time.monotonic() - began)
        cpu, wall = time.process_time() - cpu, time.monotonic() - wall
        gc.callbacks.remove(note)
        said = {"cpu": cpu / wall, "refused": refused, "lates": lates, "tooks": tooks, "collected": collected}
        print(json.dumps(said), flush=True)


def process(what: str, *arguments: str) -> None:
    """Be one of the other processes; see the module."""
    # As VRG's own processes do.
    sys.setswitchinterval(1e-3)
    if what == "drives":
        _drives([int(node) for node in arguments])
        return
    for option in arguments[4:]:
        if option == "no-gc":
            gc.disable()
        else:
            sys.setswitchinterval(float(option.partition("=")[2]))
    _command(int(arguments[0]), int(arguments[1]), float(arguments[2]), float(arguments[3]))
