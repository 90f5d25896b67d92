"""What goes wrong with a drive, or is said to it by others: the robot stops, says why, and waits to be told to move."""

import math
from collections.abc import Callable

import pytest

from tests.hal.can.handling import (
    AHEAD,
    armed,
    assert_latched,
    at_rest,
    drive_on,
    gets_going,
    notices,
    recovers,
    wait,
)
from vrg.bus.messages import MeasuredPose
from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.workshop.faults import FaultKind
from vrg.hal.sensors.encoders import Encoders
from vrg.hal.sensors.ins import Ins
from vrg.testing.can.bench import KEYS, LINK, PATIENCE, START, DeviceBench, Drives, Lab


class TestDrives:
    """Something is wrong with one drive."""

    @pytest.mark.parametrize(
        ("protocol", "node", "kind", "value", "words"),
        [
            ("odrive", 0, FaultKind.SILENCE, 0, "node 0: no heartbeat"),
            ("odrive", 1, FaultKind.SILENCE, 0, "node 1: no heartbeat"),
            ("odrive", 0, FaultKind.FREEZE, 0, "node 0: no heartbeat"),
            ("odrive", 1, FaultKind.REBOOT, 0, "node 1:"),
            ("odrive", 1, FaultKind.ERROR, 0x20 | 0x1000, "DRV_FAULT, CURRENT_LIMIT_VIOLATION"),
            ("odrive", 0, FaultKind.NAN, 0, "nan"),
            ("odrive", 0, FaultKind.LENGTH, 0, "malformed"),
            ("odrive", 0, FaultKind.JUMP, 0, "jumped"),
            ("odrive", 0, FaultKind.GARBAGE, 0, "node 0:"),
            ("odrive", 0, FaultKind.REVERSE, 0, "the wrong way round"),
            ("odrive", 0, FaultKind.BLOCK, 0, "it stands still, though asked for 23.9 turn/s"),
            ("odrive", 0, FaultKind.RUNAWAY, 0, "it runs away"),
            ("odrive", 0, FaultKind.SCALE, 0, "where this robot's motors reach 50.64"),
            ("odrive", 0, FaultKind.JUMP, 15, "its position jumped"),
            ("odrive", 0, FaultKind.JUMP, 3, "its position jumped by +"),
            ("odrive", 0, FaultKind.JUMP, -6, "its position jumped by -"),
            ("cia402", 2, FaultKind.SILENCE, 0, "node 2: no heartbeat"),
            ("cia402", 2, FaultKind.FREEZE, 0, "node 2: no heartbeat"),
            ("cia402", 2, FaultKind.ERROR, 0, "node 2: "),
            ("cia402", 2, FaultKind.REBOOT, 0, "node 2: "),
            ("cia402", 2, FaultKind.LENGTH, 0, "node 2: a malformed frame"),
            ("cia402", 2, FaultKind.JUMP, 0, "node 2: its position jumped"),
            ("cia402", 2, FaultKind.GARBAGE, 0, "node 2: "),
            ("cia402", 2, FaultKind.REVERSE, 0, "node 2: it turns at -"),
            ("cia402", 2, FaultKind.RUNAWAY, 0, "node 2: it turns at "),
        ],
    )
    def test_what_goes_wrong_latches_and_is_recovered_from(
        self, going: DeviceBench, drives: Drives, node: int, kind: FaultKind, value: int, words: str
    ) -> None:
        before = going.odometry.pose
        going.fault(node, kind, value=value)
        notices(going)
        estop = going.device.read().estop
        assert_latched(going, drives, f"node {node}: " if estop else words)
        reading, odometry = going.device.read(), going.odometry
        encoders, ins = reading.latest(Encoders), reading.latest(Ins)
        assert encoders is not None
        assert ins is not None
        pose, twist = odometry.pose, odometry.twist
        numbers = (twist.v, twist.w, pose.x, pose.y, ins.value.pose.theta, *encoders.value.counts)
        assert all(math.isfinite(number) for number in numbers)
        assert math.dist((before.x, before.y), (pose.x, pose.y)) < 0.5, "a jump is no way that it went"
        going.fault(node, FaultKind.END)
        for _ in range(8):
            drive_on(going)
        assert going.trouble, "a drive that is well again clears nothing"
        if going.device.read().estop:
            going.estop(False)  # among random bits there was one of an emergency stop
        recovers(going)

    def test_one_wheel_faults_and_the_other_idles_at_once(self, going: DeviceBench, drives: Drives) -> None:
        going.fault(0, FaultKind.ERROR, value=messages.AxisError.MOTOR_OVER_TEMP)
        # Nobody reads or drives meanwhile: it is the receive thread that switches the other one off.
        other = drives.drives[1]
        assert going.clock.wait(lambda: not other._energised, PATIENCE), "the other wheel goes on"
        assert not other._reason, "it was told to idle before its own watchdog noticed"
        assert_latched(going, drives, "node 0: MOTOR_OVER_TEMP")
        recovers(going)

    def test_a_fault_that_is_still_there_comes_back(self, going: DeviceBench, drives: Drives) -> None:
        going.fault(0, FaultKind.SILENCE)
        assert_latched(going, drives, "no heartbeat")
        going.recover()
        going.device.read()
        going.advance(1.5)
        assert_latched(going, drives, "no heartbeat")

    @pytest.mark.parametrize(
        "order",
        [
            messages.SetInputVel(5.0),
            messages.SetLimits(120.0, 12.0),
            messages.RxSdo(1, 3, 0x43480000),  # the ramp, 200 turn/s^2
            messages.SetAxisState(messages.AxisState.CLOSED_LOOP_CONTROL),
            messages.SetAxisState(messages.AxisState.IDLE),
        ],
    )
    @pytest.mark.parametrize("node", [1, codec.BROADCAST], ids=["to it", "to all"])
    def test_another_masters_orders(
        self, going: DeviceBench, drives: Drives, order: messages.Message, node: int
    ) -> None:
        going.inject(codec.encode(node, order))
        assert_latched(going, drives, f"another program commands it too: {type(order).__name__}")
        assert node == codec.BROADCAST or "node 1: " in going.trouble
        recovers(going)

    @pytest.mark.parametrize("protocol", ["odrive", "cia402"])
    def test_a_recovery_of_a_robot_that_is_well_harms_nothing(self, going: DeviceBench) -> None:
        """An official recovers all robots because of one; the player of another one ticks on meanwhile."""
        going.recover()
        for _ in range(15):
            drive_on(going)
            assert going.device.read().fault is None
        gets_going(going)


class TestCommands:
    """What is sent, and what never is."""

    @pytest.mark.parametrize(
        ("protocol", "is_setpoint", "most"),
        [
            ("odrive", lambda frame: codec.command_of(frame.id) == messages.Command.SET_INPUT_VEL, 2),
            ("cia402", lambda frame: frame.id & ~0x7F == 0x300, 0),
        ],
        ids=["odrive", "cia402"],
    )
    def test_nothing_is_sent_while_nobody_drives(
        self, going: DeviceBench, drives: Drives, is_setpoint: Callable[[Frame], bool], most: int
    ) -> None:
        frames: list[Frame] = []
        bus = Lab.simulation.bus(LINK, frames.append)
        bus.start()
        going.advance(1.0)
        assert frames
        assert sum(map(is_setpoint, frames)) <= most
        wait(going, lambda: at_rest(drives), "the motors to stand")

    def test_it_tells_the_world_where_it_is(self, bench: DeviceBench) -> None:
        armed(bench)
        bench.hear(KEYS.robot_seen("r"), MeasuredPose(pose=START))
        bench.advance(0.05)
        for _ in range(20):
            bench.device.drive(AHEAD)
            bench.device.read()
            bench.device.report()
            bench.advance(0.05)
        told = [body for key, body in bench.said if key == KEYS.robot_pose("r").key]
        assert told
        assert isinstance(told[-1], MeasuredPose)
        way = math.hypot(told[-1].pose.x - START.x, told[-1].pose.y - START.y)
        assert 0.1 < way < 0.5
        assert told[-1].pose.theta == pytest.approx(START.theta, abs=0.05)
