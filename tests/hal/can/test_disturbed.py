"""Frames that come late, twice or in the wrong order, drives that start again as others, and phantoms on the bus."""

import random
import struct
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from msgspec.structs import replace as replaced

from tests.hal.can.handling import armed, at_rest, drive_on, driving
from tests.hal.can.scenes import AHEAD, ALL, Case, Plant, Scene, encoder, judge, scene_of
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.emulated import EmulatedDrive
from vrg.hal.can.workshop.simulation import Tamper
from vrg.testing.can.bench import NODES, PATIENCE, STEP, CanBench, DeviceBench, Drives, Lab
from vrg.types import STILL, Twist

REST = 0.45
"""s from what stops a robot until it stands, besides the s by which frames are late."""


def holding(scene: Scene) -> None:
    """Its drive goes on with the last setpoint, whatever comes, and without its watchdog."""
    own, aim = scene.drive.motor, scene.drive.motor.velocity
    scene.wrap(scene.drive, "_move", lambda dt: own.turn(dt, aim))


def swapped(scene: Scene) -> None:
    """The numbers of its encoder have another byte order, as behind a gateway of somebody's own."""
    drive, kinds = scene.drive, {"odrive": {0x29}, "cia402": {0x282}, "vesc": {0x902, 0x1B02}}
    shown = drive._shown

    def reversed_words(frame: Frame) -> bytes:
        data = frame.data
        if scene.protocol == "moteus" and data[3:5] == b"\x2e\x01":
            return data[:5] + data[8:4:-1] + data[12:8:-1] + data[13:]
        if frame.id not in kinds.get(scene.protocol, ()):
            return data
        return data[3::-1] + (data[:3:-1] if scene.protocol != "vesc" else data[4:])

    scene.wrap(drive, "_shown", lambda frames: [replaced(f, data=reversed_words(f)) for f in shown(frames)])


def started_again(as_another: Callable[[EmulatedDrive], Callable[[], None]]) -> Plant:
    """It is switched off and on, and is another one from then on, until what is returned is done, and off and on."""

    def plant(scene: Scene) -> None:
        undo = as_another(scene.drive)
        scene.drive._restart(scene.now)

        def mend() -> None:
            undo()
            scene.drive._restart(scene.now)
            scene.bench.advance(0.5)

        scene.mend.append(mend)

    return plant


def with_objects(values: dict[tuple[int, int], int]) -> Callable[[EmulatedDrive], Callable[[], None]]:
    """A CiA 402 drive that has other values."""

    def change(drive: EmulatedDrive) -> Callable[[], None]:
        stored = drive._stored  # type: ignore[attr-defined]
        before = dict(stored)
        stored.update(values)

        def undo() -> None:
            stored.clear()
            stored.update(before)

        return undo

    return change


def with_serial(drive: EmulatedDrive) -> Callable[[], None]:
    """Another drive of this id."""
    options = drive.options
    drive.options = replace(options, serial=0xBAD)
    return lambda: setattr(drive, "options", options)


def with_answer(wanted: bytes, instead: bytes) -> Callable[[EmulatedDrive], Callable[[], None]]:
    """A drive of another version: whatever it says that has these bytes has others."""

    def change(drive: EmulatedDrive) -> Callable[[], None]:
        shown = drive._shown

        def changed(frames: list[Frame]) -> list[Frame]:
            return [replaced(f, data=f.data.replace(wanted, instead)) for f in shown(frames)]

        drive._shown = changed  # type: ignore[method-assign]
        return lambda: delattr(drive, "_shown")

    return change


def with_old_firmware(drive: EmulatedDrive) -> Callable[[], None]:
    """A VESC of firmware 3.62."""
    interpret = drive._interpret  # type: ignore[attr-defined]
    drive._interpret = lambda payload: interpret(payload).replace(b"\0\5\3VRG", b"\0\3\x3eVRG")  # type: ignore[attr-defined]
    return lambda: delattr(drive, "_interpret")


def of_mode(scene: Scene) -> None:
    """Somebody gives a CiA 402 drive another mode of operation, at its panel."""
    scene.drive.objects[0x6060, 0] = 1  # type: ignore[attr-defined]


def of_supply(scene: Scene) -> None:
    """The supply has 60 V."""
    options = scene.drive.options
    scene.drive.options = replace(options, voltage=60.0)
    scene.mend.append(lambda: setattr(scene.drive, "options", options))


def to_and_fro(period: float) -> Plant:
    """The encoder jumps by four turns, and back."""
    return lambda scene: encoder(lambda _p, _v, q, w: (q + 4.0 * (scene.now % (2 * period) < period), w))(scene)


AGAIN = ("started again", "jumped", "idle", "heartbeat", "expected the network state")
CASES = (
    Case("it obeys no setpoint", ALL, holding, ("it still turns at", "on, though"), 1.0, 1.1, AHEAD, Twist(-0.33, 0.0)),
    Case("it does not stop", ALL, holding, ("it still turns at", "on, though"), 1.0, 1.1, AHEAD, STILL),
    Case("other byte order", ALL, swapped, ("byte order", "where this robot's motors reach", "it stands still")),
    Case("it jumps to and fro", ALL, to_and_fro(0.2), ("jumped to and fro",), 2.0, 0.1),
    Case("60 V", ALL, of_supply, ("its supply has 60 V, where a full battery has 25.2 V",), 3.0, 0.1),
    Case("another mode", "cia402", of_mode, ("its mode of operation (0x6061) is 1",), 0.4, 0.2),
    Case(
        "four times the counts", "cia402", started_again(with_objects({(0x608F, 1): 40_000})), AGAIN,
        refused="units: expected 10000 counts in a turn, 10000 units of velocity in 1 turn/s, as when",
    ),
    Case(
        "other units of speed", "cia402", started_again(with_objects({(0x60A9, 0): 0x00B44700})), AGAIN,
        refused="units: expected 10000 counts",
    ),
    Case(
        "no profile velocity", "cia402", started_again(with_objects({(0x6502, 0): 1})), AGAIN,
        refused="expected a drive with profile velocity mode",
    ),
    Case(
        "another drive", ALL, started_again(with_serial), ("serial number BAD, expected",),
        refused="its drive has serial number BAD, expected 1001",
    ),
    Case(
        "other firmware", "odrive", started_again(with_answer(b"\x00\x06\x0b", b"\x00\x07\x00")), AGAIN,
        refused="firmware: expected 0.6.11, as when the robot was connected, got 0.7.0",
    ),
    Case(
        "other firmware", "cia402", started_again(with_answer(b"1.0.0", b"1.0.1")), AGAIN,
        refused="firmware: expected 1.0.0, as when the robot was connected, got 1.0.1",
    ),
    Case(
        "old register map", "moteus",
        started_again(with_answer(struct.pack("<ii", 0x10001, 5), struct.pack("<ii", 0x10001, 4))), AGAIN,
        refused="expected register map version 5 or newer, got 4",
    ),
    Case(
        "old firmware", "vesc", started_again(with_old_firmware), AGAIN,
        refused="expected firmware 5.03 or newer",
    ),
)  # fmt: skip
BRIEF = {
    "moteus: it obeys no setpoint", "vesc: it does not stop", "cia402: other byte order", "odrive: it jumps to and fro",
    "cia402: another mode", "cia402: four times the counts", "moteus: old register map", "vesc: another drive",
}  # fmt: skip
"""Those that every change is tested by; the others are thorough."""
TABLE = {f"{spoken}: {case.what}": (spoken, case) for case in CASES for spoken in case.protocols.split()}


@pytest.mark.parametrize(
    ("protocol", "case"),
    [pytest.param(*row, id=name, marks=() if name in BRIEF else pytest.mark.thorough) for name, row in TABLE.items()],
)
def test_the_robot_stands_and_recovers_only_with_what_was_connected(protocol: str, case: Case) -> None:
    with scene_of(protocol) as scene:
        judge(scene, case)


EVERY_PROTOCOL = pytest.mark.parametrize("protocol", NODES)


def late(seconds: float, *, of_drives: bool) -> Tamper:
    """Frames of the drives, or those to them, are late."""
    return lambda frame, by_drive: [(seconds if by_drive == of_drives else 0.0, frame)]


def rest(bench: CanBench, drives: Drives, within: float) -> None:
    """Every motor stands after a while, and goes on to do so."""
    bench.clock.sleep(within)
    assert at_rest(drives), [drive.motor.velocity for drive in drives.drives]
    for _ in range(50):
        bench.clock.sleep(STEP)
        assert at_rest(drives), "it moves again by itself"


SLOW = ("come late", "does it hear this computer", "hears it late", "though it was ordered to be off")
"""The words for a way that is too slow, as it looks from different protocols."""


@EVERY_PROTOCOL
@pytest.mark.parametrize(
    ("seconds", "of_drives"), [(0.05, True), (0.15, True), (0.3, True), (0.05, False), (0.15, False), (0.4, False)]
)
def test_whoever_is_armed_over_a_slow_way_stands_as_soon_or_is_not_armed(
    protocol: str, seconds: float, of_drives: bool
) -> None:
    with scene_of(protocol) as scene:
        bench = scene.bench
        bench.wire.tamper = late(seconds, of_drives=of_drives)
        bench.device.start()
        end = bench.now + PATIENCE
        while not bench.device.read().armed and not bench.trouble:
            assert bench.now < end, "it neither drives nor says why"
            drive_on(bench, STILL)
        if bench.trouble:
            assert any(words in bench.trouble for words in SLOW), bench.trouble
            return
        assert seconds < 0.2, "its watchdog stops it too late for what a match is told"
        for _ in range(20):
            drive_on(bench)
        assert not at_rest(scene.drives)
        bench.port.stop()
        rest(bench, scene.drives, REST + (0.0 if of_drives else seconds))


@EVERY_PROTOCOL
@pytest.mark.parametrize("newest_first", [False, True], ids=["in order", "newest first"])
def test_orders_that_come_in_a_burst(protocol: str, newest_first: bool) -> None:
    """A way to the drives that stands still for 0.4 s; then all comes at once, the emergency stop among it."""
    with scene_of(protocol) as scene:
        bench = scene.bench
        driving(bench)
        began, held = bench.now, 0.4

        def delayed(frame: Frame, by_drive: bool) -> list[tuple[float, Frame]]:
            since = bench.now - began
            if by_drive or since > held:
                return [(0.0, frame)]
            return [(held - since + (1e-4 * (held - since) if newest_first else 0.0), frame)]

        bench.wire.tamper = delayed
        while bench.now < began + held:
            drive_on(bench)
        bench.estop(True)
        bench.device.hear()
        rest(bench, scene.drives, REST)


@EVERY_PROTOCOL
def test_a_way_that_has_become_slow_is_found_as_it_stops_the_robot(protocol: str) -> None:
    with scene_of(protocol) as scene:
        bench = scene.bench
        driving(bench)
        bench.wire.tamper = late(0.4, of_drives=False)
        end = bench.now + 10.0
        while bench.now < end and not bench.trouble:
            drive_on(bench)
        assert any(words in bench.trouble for words in SLOW), bench.trouble
        rest(bench, scene.drives, REST + 0.4)


def twice(frame: Frame, by_drive: bool) -> list[tuple[float, Frame]]:
    """A gateway that repeats each frame of a drive."""
    return [(0.0, frame), (0.015, frame)] if by_drive else [(0.0, frame)]


def exchanged() -> Tamper:
    """Every second frame comes behind the next one."""
    turn = random.Random(1)
    return lambda frame, _: [(0.001 * turn.randrange(2), frame)]


def beside(frames: Sequence[Frame]) -> Plant:
    """Frames of others, whom nobody here speaks to, ten times a second."""

    def plant(scene: Scene) -> None:
        def send() -> None:
            for frame in frames:
                scene.bench.wire.put(frame)
            Lab.simulation.clock.at(scene.now + 0.1, send)

        send()

    return plant


STRANGERS = [
    Frame(0x77F, b"\x05"), Frame(0x61A, b"\x40\x41\x60\0\0\0\0\0"), Frame(0x59A, b"\x4b\x41\x60\0\x37\2\0\0"),
    Frame(0x80, b""), Frame(0x18FEF100, bytes(8), extended=True), Frame(0x0CF00400, b"\xff" * 8, extended=True),
]  # fmt: skip
"""The heartbeats of a CANopen master, its questions to a stepper with the answers, SYNC, and a lorry's J1939."""


@EVERY_PROTOCOL
@pytest.mark.parametrize(
    "plant",
    [
        lambda scene: setattr(scene.bench.wire, "tamper", twice),
        lambda scene: setattr(scene.bench.wire, "tamper", exchanged()),
        beside(STRANGERS),
    ],
    ids=["repeated", "exchanged", "strangers"],
)
def test_what_is_no_fault_is_called_none(protocol: str, plant: Plant) -> None:
    with scene_of(protocol) as scene:
        bench = scene.bench
        armed(bench)
        plant(scene)
        x, truly = bench.odometry.pose.x, scene.drive.motor.position
        for _ in range(60):
            drive_on(bench)
            assert not bench.trouble
        way = (scene.drive.motor.position - truly) / 50 * 2 * 3.14159 * 0.11
        assert bench.odometry.pose.x - x == pytest.approx(way, rel=0.1)
        assert bench.device.read().armed
        assert abs(bench.odometry.pose.theta) < 0.05


@EVERY_PROTOCOL
@pytest.mark.parametrize("stamped", [True, False], ids=["stamped", "unstamped"])
def test_a_busy_computer_is_no_fault_of_a_drive(protocol: str, stamped: bool) -> None:
    """The process stands again and again, for up to 0.45 s; some adapters do not tell when frames were on the bus."""
    rng = random.Random(protocol)
    with scene_of(protocol) as scene:
        bench = scene.bench
        armed(bench)
        for _ in range(20):
            twist = Twist(rng.choice((0.33, -0.33, 0.6)), rng.choice((0.0, 0.4, -0.4)))
            for _ in range(rng.randrange(1, 8)):
                drive_on(bench, twist)
            bench.port.freeze()
            bench.clock.sleep(rng.uniform(0.05, 0.45))
            if not stamped:
                bench.port._waiting[:] = [replaced(frame, at=bench.now) for frame in bench.port._waiting]
            bench.port.thaw()
            assert not bench.trouble


@EVERY_PROTOCOL
def test_a_robot_that_is_recovered_as_it_drives_stands_though_orders_are_lost(protocol: str) -> None:
    rng = random.Random(protocol)
    with Drives(protocol, watchdog=0.0) as drives, DeviceBench(protocol, watchdog="unsafe") as bench:
        driving(bench)
        bench.wire.tamper = lambda frame, _: [] if rng.random() < 0.3 else [(0.0, frame)]
        bench.recover()
        bench.advance(0.0)
        rest(bench, drives, REST)
