"""One ODrive axis, by frames and times."""

import math

import pytest

from tests.hal.can.odrive.wire import CLOSED, IDLE, Wire
from vrg.errors import RobotError
from vrg.hal.can.axis import MotorState
from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.axis import OdriveAxis
from vrg.hal.can.odrive.messages import AxisError, AxisState, Command, ProcedureResult
from vrg.hal.can.workshop.listener import Claim
from vrg.hal.can.workshop.odrive.listener import OdriveListener
from vrg.hal.simulated_clock import SimulatedClock


@pytest.fixture
def wire() -> Wire:
    return Wire()


class TestAxis:
    def test_a_start_sends_mode_zero_and_closed_loop_in_this_order(self, wire: Wire) -> None:
        wire.beat()
        wire.axis.start()
        assert wire.said() == [
            messages.SetControllerMode(messages.VELOCITY_CONTROL, messages.PASSTHROUGH),
            messages.SetInputVel(0.0),
            messages.SetAxisState(CLOSED),
        ]
        assert wire.axis.state is MotorState.STARTING
        wire.beat(IDLE)  # sent before the drive had started
        assert wire.axis.state is MotorState.STARTING
        wire.beat(CLOSED)
        assert wire.axis.state is MotorState.CLOSED_LOOP
        wire.beat(IDLE)
        assert wire.axis.state is MotorState.IDLE

    def test_a_position_far_from_zero_is_set_back_before_a_start(self, wire: Wire) -> None:
        wire.hear(messages.EncoderEstimates(1e6, 0.0))
        wire.axis.start()
        assert wire.said()[0] == messages.SetAbsolutePosition(0.0)

    @pytest.mark.parametrize(
        ("error", "state", "fault", "starved"),
        [
            (AxisError.WATCHDOG_TIMER_EXPIRED, MotorState.IDLE, None, True),
            (AxisError.ESTOP_REQUESTED, MotorState.ESTOP, None, False),
            (AxisError.DRV_FAULT, MotorState.FAULT, "DRV_FAULT", False),
            (AxisError.DRV_FAULT | AxisError.ESTOP_REQUESTED, MotorState.ESTOP, "DRV_FAULT", False),
            (AxisError.WATCHDOG_TIMER_EXPIRED | AxisError.MISSING_ESTIMATE, MotorState.FAULT, "MISSING_ESTIMATE", True),
        ],
    )
    def test_errors(self, wire: Wire, error: int, state: MotorState, fault: str | None, starved: bool) -> None:
        wire.beat(IDLE, error)
        assert (wire.axis.state, wire.axis.fault, wire.axis.watchdog_expired) == (state, fault, starved)

    def test_a_drive_that_calibrates_is_no_idle_one(self, wire: Wire) -> None:
        wire.beat(AxisState.MOTOR_CALIBRATION)
        assert wire.axis.state is MotorState.FAULT
        assert "MOTOR_CALIBRATION" in (wire.axis.fault or "")

    @pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
    def test_numbers_that_are_none_are_odd_and_change_nothing(self, wire: Wire, bad: float) -> None:
        wire.hear(messages.EncoderEstimates(2.0, 1.0), at=5.0)
        for estimate in (messages.EncoderEstimates(bad, 1.0), messages.EncoderEstimates(1.0, bad)):
            wire.hear(estimate, at=6.0)
        assert (wire.axis.position, wire.axis.velocity, wire.axis.measured) == (2.0, 1.0, 5.0)
        assert wire.axis.implausible is not None

    @pytest.mark.parametrize(
        "frame",
        [
            *(codec.encode(4, message) for message in (messages.RxSdo(0, 7, 0), messages.TxSdo(0, 7, 1))),
            codec.encode(4, messages.BusVoltageCurrent(24.0, 1.0)),
            *(Frame(codec.frame_id(4, command), bytes(8)) for command in (0x03, 0x14, 0x15, 0x1C, 0x1D)),
            codec.request(codec.BROADCAST, Command.ADDRESS),
            codec.encode(codec.BROADCAST, messages.Address(codec.BROADCAST, 77)),  # of a drive without an id
        ],
        ids=lambda frame: f"{frame.id:#x}",
    )
    def test_questions_their_answers_and_other_values_are_not(self, wire: Wire, frame: Frame) -> None:
        wire.axis.receive(frame)
        assert wire.axis.implausible is None

    @pytest.mark.parametrize("node", [4, codec.BROADCAST], ids=["to it", "to all"])
    def test_somebody_elses_estop_counts_at_once(self, wire: Wire, node: int) -> None:
        wire.beat(CLOSED)
        wire.hear(messages.Estop(), node=node)
        assert wire.axis.state is MotorState.ESTOP

    def test_other_nodes_and_extended_and_remote_frames_are_not_its_business(self, wire: Wire) -> None:
        wire.hear(messages.Heartbeat(0xFF, 1), node=5)
        wire.axis.receive(Frame(codec.frame_id(4, 1), bytes(8), extended=True))
        wire.axis.receive(Frame(codec.frame_id(4, 1), remote=True))
        assert wire.axis.state is MotorState.SILENT
        assert wire.axis.implausible is None
        wire.beat(at=3.5)
        assert (wire.axis.state, wire.axis.heard) == (MotorState.IDLE, 3.5)

    def test_two_serial_numbers_are_a_problem(self, wire: Wire) -> None:
        wire.hear(messages.Version(2, 4, 4, 58, 0, 6, 11, 0))
        wire.hear(messages.Address(4, 0xAAA))
        assert wire.axis.identified
        assert (wire.axis.problem, wire.axis.serial, wire.axis.firmware) == (None, "AAA", "0.6.11")
        wire.hear(messages.Address(4, 0xBBB))
        assert "AAA and BBB" in (wire.axis.problem or "")

    def test_why_it_does_not_start_is_told(self, wire: Wire) -> None:
        wire.beat()
        wire.hear(messages.Heartbeat(0, IDLE, ProcedureResult.NOT_CALIBRATED))
        assert wire.axis.refusal is None, "nobody has asked it to start"
        wire.axis.start()
        wire.hear(messages.Heartbeat(0, IDLE, ProcedureResult.NOT_CALIBRATED))
        assert wire.axis.refusal == "NOT_CALIBRATED (calibrate motor and encoder, and save that)"
        wire.axis.start()
        assert wire.axis.refusal is None

    def test_the_voltage_is_asked_for_where_it_is_not_sent(self, wire: Wire) -> None:
        asks = [Frame(codec.frame_id(4, Command.BUS_VOLTAGE_CURRENT), remote=True)]
        wire.axis.poll(10.0)
        assert wire.sent == asks
        wire.hear(messages.BusVoltageCurrent(24.0, 0.0), at=10.1)
        wire.axis.poll(11.0)
        assert wire.sent == asks, "it is known"
        wire.axis.poll(12.0)
        wire.axis.poll(12.05)
        assert wire.sent == asks * 2, "it is asked once"

    @pytest.mark.parametrize("volts", [math.nan, math.inf, -1.0, 1e30])
    def test_a_voltage_that_no_supply_has_is_odd(self, wire: Wire, volts: float) -> None:
        wire.hear(messages.BusVoltageCurrent(24.0, 0.0))
        wire.hear(messages.BusVoltageCurrent(volts, 0.0))
        assert wire.axis.voltage == 24.0
        assert "its supply says" in (wire.axis.implausible or "")

    def test_another_protocol_version_is_a_problem(self, wire: Wire) -> None:
        wire.hear(messages.Version(3, 4, 4, 58, 0, 7, 0, 0))
        assert wire.axis.problem == "expected CANSimple protocol version 2, got 3"

    def test_orders_are_frames_and_those_that_switch_off_are_urgent(self, wire: Wire) -> None:
        wire.axis.stop_now()
        wire.axis.clear()
        wire.axis.idle()
        wire.axis.command(2.5)
        stop, off = messages.Estop(), messages.SetAxisState(IDLE)
        assert wire.said() == [stop, messages.ClearErrors(), off, messages.SetInputVel(2.5)]
        wire.axis.start()
        assert [codec.decode(frame) for frame in wire.urgent] == [stop, off]


def test_robot_errors_of_the_sender_go_on_to_the_caller() -> None:
    def full(_: Frame, *, urgent: bool = False) -> None:
        raise RobotError("full")

    with pytest.raises(RobotError, match="full"):
        OdriveAxis(0, full, SimulatedClock()).command(1.0)


class TestFirmware05:
    """It answers no question for a version, and takes every frame of command 6 for an order to change its id."""

    def test_it_is_refused_in_words_and_never_asked_what_it_would_obey(self, wire: Wire) -> None:
        wire.beat()
        for _ in range(10):
            assert not wire.axis.identified
            wire.axis.identify(0.5)
            if wire.axis.problem:
                break
        assert "expected firmware 0.6 or newer" in (wire.axis.problem or "")
        assert wire.axis.identified, "nobody waits for its version any more"
        assert {codec.command_of(frame.id) for frame in wire.sent} == {Command.VERSION}

    def test_one_that_tells_its_version_late_is_none(self, wire: Wire) -> None:
        wire.beat()
        wire.axis.identify(0.5)
        wire.hear(messages.Version(messages.PROTOCOL_VERSION, 4, 4, 58, 0, 6, 11, 0))
        assert wire.axis.problem is None
        assert wire.sent[-1] == codec.request(4, Command.ADDRESS)

    def test_a_scan_asks_for_no_serial_number_either(self) -> None:
        sent: list[Frame] = []
        listener = OdriveListener(lambda frame, urgent=False: sent.append(frame), SimulatedClock())
        beat = codec.encode(4, messages.Heartbeat(0, IDLE))
        assert listener.claim(beat) is not Claim.NONE
        listener.hear(beat)
        listener.ask(listener.found[4])
        assert Command.ADDRESS not in {codec.command_of(frame.id) for frame in sent}
