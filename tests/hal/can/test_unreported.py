"""Faults that no drive reports: a loose plug, a slipping encoder, a swapped id. Each stops the robot, and is named.

Each fault is planted in the right drive or its motor while the robot drives, on simulated time. What counts is what the
motors truly do from then on.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.hal.can.handling import drive_on, driving, notices, recovers, wait
from tests.hal.can.scenes import AHEAD, ALL, Case, Plant, Scene, encoder, judge, motor, plug, scene_of
from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.faults import FaultKind
from vrg.testing.can.bench import NODES, DeviceBench, Drives, Lab
from vrg.types import STILL, Twist

SLOW, CRAWL = Twist(0.1, 0.0), Twist(0.03, 0.0)


def without_a_phase(scene: Scene) -> None:
    """A motor of which one wire is off jerks, and does not turn."""
    own = scene.drive.motor

    def jerk(dt: float, _: float) -> None:
        own.velocity = 0.4 * math.sin(100.0 * scene.now)
        own.position += own.velocity * dt

    scene.wrap(own, "turn", jerk)


creeping = motor(lambda dt, v: (dt, v or 1.5))


def limited(scene: Scene) -> None:
    """A drive whose speed is limited to 5 turn/s."""
    own, most = scene.drive.motor, scene.drive.motor.velocity_limit
    own.velocity_limit = 5.0
    scene.mend.append(lambda: setattr(own, "velocity_limit", most))


def jerking(scene: Scene) -> None:
    """A velocity loop whose gain is far too high."""
    turn, began = scene.drive.motor.turn, scene.now
    scene.wrap(scene.drive.motor, "turn", lambda dt, v: turn(dt, v * (1.0 + 1.5 * math.sin(5.0 * (scene.now - began)))))


def restarting(scene: Scene) -> None:
    """A brown-out that comes again and again."""
    clock = Lab.simulation.clock
    again = [True]

    def restart() -> None:
        if again:
            scene.drive._restart(scene.now)
            clock.at(scene.now + 1.0, restart)

    restart()
    scene.mend.append(again.clear)


def weak(scene: Scene) -> None:
    """Its current is limited to a twentieth while it drives; then it is to drive back."""
    own, torque = scene.drive.motor, scene.drive.motor.model
    own.model = replace(torque, current_limit=0.05 * torque.current_limit)
    own.current_limit = own.model.current_limit

    def strong() -> None:
        own.model, own.current_limit = torque, torque.current_limit

    scene.mend.append(strong)


def supply(period: float) -> Plant:
    """Let the supply have 12 V for all but 0.1 s of each period."""

    def plant(scene: Scene) -> None:
        drive, began = scene.drive, scene.now
        options, advance = drive.options, drive._advance

        def advanced(now: float) -> None:
            low = (now - began) % period < period - 0.1
            drive.options = replace(options, voltage=12.0 if low else options.voltage)
            advance(now)

        def full() -> None:
            drive.options = options

        scene.wrap(drive, "_advance", advanced)
        scene.mend.append(full)

    return plant


def lost(which: Callable[[Frame, bool], bool]) -> Plant:
    """Lose some frames, by whether a drive sends them."""

    def plant(scene: Scene) -> None:
        wire = scene.bench.wire
        wire.tamper = lambda frame, by_drive: [] if which(frame, by_drive) else [(0.0, frame)]
        scene.mend.append(lambda: setattr(wire, "tamper", None))

    return plant


def duplicate(scene: Scene) -> None:
    """A drive that has the same id is plugged in."""
    other = Drives(scene.protocol, [scene.drive.node], serial=0x2000)
    other.__enter__()
    scene.mend.append(lambda: other.__exit__(None, None, None))


def planted(kind: FaultKind, value: int = 0) -> Plant:
    """A fault that emulated drives have by themselves."""

    def plant(scene: Scene) -> None:
        scene.bench.fault(scene.drive.node, kind, value=value)
        scene.mend.append(lambda: scene.bench.fault(scene.drive.node, FaultKind.END))

    return plant


CASES = (
    Case("a loose plug", ALL, plug(lambda t: t % 0.6 < 0.3), ("its frames or its setpoints were lost",), 2.0, 1.2),
    Case("it hears nothing", ALL, plug(lambda _: True, speaks=True), ("hear this computer", "no heartbeat"), 2.5, 0.8),
    Case("it says nothing", ALL, plug(lambda _: True, hears=True), ("no heartbeat",), 1.0, 0.4),
    Case(
        "it slips by 15 %", ALL, encoder(lambda p, _, q, v: (p + 0.85 * (q - p), v)), ("the encoder slips",), 3.0, 0.1
    ),
    Case("its encoder stays as it is", ALL, encoder(lambda p, v, *_: (p, v)), ("the encoder slips", "jumped"), 1.0),
    Case("it tells no speed", ALL, encoder(lambda p, v, q, w: (q, 0.0)), ("the encoder slips", "it stands"), 1.0),
    Case("half its speed", ALL, motor(lambda dt, v: (dt, 0.5 * v)), ("though it was asked for",), 3.5, 0.3, SLOW),
    Case("twice its speed", ALL, motor(lambda dt, v: (dt, 2.0 * v)), ("though it was asked for",), 2.0, 0.3, SLOW),
    Case("blocked at a crawl", ALL, planted(FaultKind.BLOCK), ("it stands still, though",), 1.5, 0.1, CRAWL),
    Case("a phase is off", ALL, without_a_phase, ("it stands still, though",), 0.6, 0.3),
    Case("a second drive of its id", ALL, duplicate, ("two drives have this id",), 1.2, 0.4),
    Case("a supply that comes and goes", "moteus vesc", supply(1.0), ("has 12 V",), 2.0, 0.1),
    Case("a supply that comes and goes", "odrive cia402", supply(1.3), ("has 12 V",), 5.0, 0.1),
    Case("a weak motor, to turn back", ALL, weak, ("is its current limited",), 1.6, 0.6, AHEAD, Twist(-0.33, 0.0)),
    Case("the wrong way round", ALL, motor(lambda dt, v: (dt, -v)), ("wrong way round",), 1.0, 0.4),
    Case("it creeps, to stand", "odrive cia402 moteus", creeping, ("runs away",), 3.0, 0.1, AHEAD, STILL),
    Case("a fifth of its speed", ALL, limited, ("is it blocked or limited",), 1.0, 0.6),
    Case("it jerks", ALL, jerking, ("though it was asked for",), 3.0, 0.6),
    Case("it starts again, each second", ALL, restarting, ("started again", "idle", "jumped", "heartbeat"), 1.0, 0.6),
    Case("no setpoint", "odrive", lost(lambda f, _: f.id == 1 << 5 | 0x0D), ("its setpoints were lost",), 2.5, 0.4),
    Case(
        "no setpoint",
        "cia402",
        lost(lambda f, _: f.id == 0x300 | 2),
        ("its setpoints were lost",),
        1.5,
        0.8,
        AHEAD,
        SLOW,
    ),
    Case("no setpoint", "vesc", lost(lambda f, _: f.id == 3 << 8 | 2), ("does it hear this computer",), 2.0, 0.4),
    Case("no heartbeat", "odrive", lost(lambda f, own: own and f.id == 1 << 5 | 1), ("no heartbeat",), 1.0, 0.1),
    Case("no estimate", "odrive", lost(lambda f, own: own and f.id == 1 << 5 | 9), ("no encoder message",), 1.0, 0.1),
    Case("no statusword", "cia402", lost(lambda f, _: f.id == 0x180 | 2), ("whether its motor is on",), 1.0, 0.1),
    Case("no estimate", "cia402", lost(lambda f, _: f.id == 0x280 | 2), ("no encoder message",), 1.0, 0.1),
    Case("no status 1", "vesc", lost(lambda f, _: f.id == 9 << 8 | 2), ("whether its motor is on",), 1.0, 0.1),
    Case("no status 5", "vesc", lost(lambda f, _: f.id == 27 << 8 | 2), ("no encoder message",), 1.0, 0.1),
)
BRIEF = {
    "vesc: a loose plug", "vesc: it hears nothing", "cia402: it slips by 15 %", "moteus: half its speed",
    "odrive: blocked at a crawl", "vesc: a phase is off", "cia402: a second drive of its id",
    "moteus: a supply that comes and goes", "odrive: a weak motor, to turn back", "cia402: no setpoint",
}  # fmt: skip
"""Those that every change is tested by; the others are thorough."""
TABLE = {f"{spoken}: {case.what}": (spoken, case) for case in CASES for spoken in case.protocols.split()}


@pytest.mark.parametrize(
    ("protocol", "case"),
    [pytest.param(*row, id=name, marks=() if name in BRIEF else pytest.mark.thorough) for name, row in TABLE.items()],
)
def test_the_robot_stands_and_the_fault_is_named(protocol: str, case: Case) -> None:
    with scene_of(protocol) as scene:
        judge(scene, case)


EVERY_PROTOCOL = pytest.mark.parametrize("protocol", NODES)


@EVERY_PROTOCOL
def test_drives_that_have_swapped_their_ids_are_not_driven(protocol: str) -> None:
    """Both start again, each with the other's id: the robot would steer the wrong way round."""
    left, right = (node for side in NODES[protocol] for node in side)
    drives = Drives(protocol)
    with DeviceBench(protocol) as bench:
        with drives:
            driving(bench)
        for _ in range(4):
            drive_on(bench)
        with Drives(protocol, [right, left]) as swapped:
            notices(bench)
            bench.recover()
            before = [drive.motor.position for drive in swapped.drives]
            wait(bench, lambda: "serial number" in bench.trouble, "the serial numbers")
            for _ in range(10):
                drive_on(bench)
            words = "its drive has serial number 100{}, expected 100{}: were ids or plugs swapped"
            assert any(words.format(*numbers) in bench.trouble for numbers in ((1, 0), (0, 1)))
            assert [drive.motor.position for drive in swapped.drives] == pytest.approx(before, abs=0.5)
        with drives:
            bench.advance(1.0)
            recovers(bench)


@EVERY_PROTOCOL
def test_a_calibration_is_of_its_drives(protocol: str, tmp_path: Path) -> None:
    nodes = [node for side in NODES[protocol] for node in side]
    axes = [f'[axes.{node}]\ndirection = 1\nratio = 50\nserial = "100{1 - n}"\n' for n, node in enumerate(nodes)]
    file = tmp_path / "r.cal.toml"
    file.write_text('robot = "r"\ntrack = 0.6\n' + "".join(axes))
    with Drives(protocol), DeviceBench(protocol, calibration=str(file)) as bench:
        bench.device.start()
        notices(bench)
        assert "its drive has serial number 1000, expected 1001" in bench.trouble
