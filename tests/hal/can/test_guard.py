"""The judgement over all axes of a robot, by frames and times."""

import math
from collections.abc import Callable

import pytest

from tests.hal.can.odrive.wire import CLOSED, IDLE, Wire
from vrg.hal.can.frame import Frame
from vrg.hal.can.guard import Guard
from vrg.hal.can.judges.off import OBEY_TIMEOUT, OFF_PERIOD
from vrg.hal.can.judges.proof import PROOF_TIMEOUT
from vrg.hal.can.judges.silence import DROPOUT_WINDOW, DROPOUTS, HEARTBEAT_TIMEOUT
from vrg.hal.can.judges.start import FAILED_STARTS, START_TIMEOUT, STATUS_GRACE
from vrg.hal.can.judges.supply import ANY_SUPPLY
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.axis import OdriveAxis
from vrg.hal.can.odrive.messages import AxisError, AxisState, Command
from vrg.hal.simulated_clock import SimulatedClock


class Live(Wire):
    """An axis whose drive sends an encoder message with each heartbeat."""

    def beat(self, state: int = IDLE, error: int = 0, at: float = 1.0) -> None:
        super().beat(state, error, at)
        self.hear(messages.EncoderEstimates(0.0, 0.0), at)


class Pair:
    """Two axes under a guard; `now` is monotonic time."""

    def __init__(self, *supply: float) -> None:
        self.wires = [Live(0), Live(1)]
        self.guard = Guard([wire.axis for wire in self.wires], supply or ANY_SUPPLY)
        self.now = 100.0
        self.beat()
        self.guard.begin(self.now)

    def beat(self, *states: int, error: int = 0) -> None:
        for wire, state in zip(self.wires, states or (IDLE, IDLE), strict=True):
            wire.beat(state, error, self.now)

    def pass_time(self, seconds: float, *states: int) -> bool:
        """Beat on; whether the motors had to be switched off."""
        end = self.now + seconds
        off = False
        while self.now < end:
            self.now += 0.05
            self.beat(*states)
            off |= self.guard.look(self.now)
        return off

    def hear(self, *states: int, error: int = 0, after: float = 0.0) -> bool:
        """What both drives say a while later, and what follows of it at once."""
        self.now += after
        self.beat(*states, error=error)
        return self.guard.look(self.now)

    def start(self, *states: int) -> None:
        """The player arms it, and the drives say where that has brought them."""
        self.guard.arm(self.now)
        for wire in self.wires:
            wire.axis.start()
        self.pass_time(0.1, *states)

    def arm(self) -> None:
        """Arm drives whose watchdogs have been proved."""
        self.guard.proof.pending = False
        assert self.guard.refusal(self.now) is None
        self.start(CLOSED, CLOSED)
        assert self.guard.armed

    @property
    def fault(self) -> str:
        """What has latched; empty where nothing has."""
        return self.guard.fault or ""


@pytest.fixture
def pair() -> Pair:
    return Pair()


@pytest.fixture
def driven(pair: Pair) -> Pair:
    """Armed, and driven for a while."""
    pair.arm()
    pair.pass_time(STATUS_GRACE + 0.5, CLOSED, CLOSED)
    return pair


class TestGuard:
    def test_a_healthy_robot_stays_armed(self, driven: Pair) -> None:
        assert not driven.pass_time(10.0, CLOSED, CLOSED)
        assert driven.guard.armed
        assert driven.guard.fault is None

    def test_heartbeats_that_cease_latch_and_come_too_late(self, driven: Pair) -> None:
        driven.now += HEARTBEAT_TIMEOUT + 0.01
        driven.wires[0].beat(CLOSED, 0, driven.now)
        assert driven.guard.look(driven.now)
        assert "node 1: no heartbeat" in driven.fault
        assert not driven.guard.look(driven.now), "told once"
        driven.pass_time(5.0)
        assert "no heartbeat" in driven.fault
        assert driven.guard.refusal(driven.now) == driven.guard.fault
        driven.guard.begin(driven.now)
        assert driven.guard.refusal(driven.now) is None

    def test_a_fault_of_one_axis_switches_all_off(self, driven: Pair) -> None:
        driven.wires[1].beat(IDLE, AxisError.MOTOR_OVER_TEMP, driven.now)
        assert driven.guard.look(driven.now)
        assert driven.fault == "node 1: MOTOR_OVER_TEMP"
        assert not driven.guard.armed_by_player

    def test_the_first_reason_is_kept(self, pair: Pair) -> None:
        pair.guard.latch("one")
        pair.guard.latch("two")
        assert pair.guard.fault == "one"

    def test_a_drives_watchdog_disarms_without_latching(self, driven: Pair) -> None:
        assert driven.hear(IDLE, IDLE, error=AxisError.WATCHDOG_TIMER_EXPIRED, after=0.1)
        assert not driven.guard.armed_by_player
        assert driven.guard.fault is None
        assert driven.guard.refusal(driven.now) is None

    def test_an_axis_that_never_starts_latches(self, pair: Pair) -> None:
        pair.start(CLOSED, IDLE)
        assert pair.pass_time(START_TIMEOUT + 0.1, CLOSED, IDLE)
        assert "node 1: expected closed-loop control" in pair.fault

    @pytest.mark.parametrize("seconds", [0.1, START_TIMEOUT + 0.2])
    def test_an_axis_that_leaves_closed_loop_for_no_reason_latches(self, pair: Pair, seconds: float) -> None:
        pair.arm()
        pair.pass_time(seconds, CLOSED, CLOSED)
        assert pair.pass_time(0.1, IDLE, CLOSED)
        assert "node 0" in pair.fault

    def test_an_estop_at_a_drive_latches_until_released(self, driven: Pair) -> None:
        driven.wires[0].beat(IDLE, AxisError.ESTOP_REQUESTED, driven.now)
        assert driven.guard.look(driven.now)
        assert driven.guard.estop
        assert driven.guard.at_drive
        driven.pass_time(5.0)
        assert driven.guard.estop, "a drive that says no more of it changes nothing"
        driven.guard.begin(driven.now)
        assert driven.guard.estop, "a recovery is no release"
        assert "emergency stop" in str(driven.guard.refusal(driven.now))
        driven.guard.release(driven.now)
        assert driven.guard.refusal(driven.now) is None
        assert not driven.guard.armed_by_player

    def test_after_the_emergency_stop_of_the_match_nobody_pressed_it_at_a_drive(self, driven: Pair) -> None:
        driven.guard.engage()
        assert not driven.guard.armed_by_player
        driven.hear(IDLE, IDLE, error=AxisError.ESTOP_REQUESTED)
        assert driven.guard.estop
        assert not driven.guard.at_drive

    def test_what_a_drive_still_says_after_a_release_does_not_latch_until_it_has_had_time(self, pair: Pair) -> None:
        pair.guard.engage()
        pair.guard.release(pair.now)
        pair.hear(IDLE, IDLE, error=AxisError.ESTOP_REQUESTED)
        assert not pair.guard.estop
        assert "emergency stop" in str(pair.guard.refusal(pair.now)), "but it is not armed either"
        pair.hear(IDLE, IDLE, error=AxisError.ESTOP_REQUESTED, after=STATUS_GRACE + 0.1)
        assert pair.guard.estop

    @pytest.mark.parametrize("error", [AxisError.MOTOR_OVER_TEMP, AxisError.ESTOP_REQUESTED])
    def test_what_goes_wrong_right_after_an_explicit_act_counts_once_it_is_armed(self, pair: Pair, error: int) -> None:
        pair.guard.begin(pair.now)
        pair.arm()
        assert pair.now - 100.0 < STATUS_GRACE
        pair.wires[1].beat(IDLE, error, pair.now)
        assert pair.guard.look(pair.now)
        assert pair.guard.fault or pair.guard.estop

    @pytest.mark.parametrize(
        "spoil",
        [
            lambda wire: wire.axis.receive(Frame(codec.frame_id(1, Command.HEARTBEAT), b"")),
            lambda wire: wire.hear(messages.EncoderEstimates(math.nan, 0.0)),
            lambda wire: wire.hear(messages.SetInputVel(3.0)),
        ],
    )
    def test_oddities_latch(self, pair: Pair, spoil: Callable[[Wire], None]) -> None:
        pair.arm()
        spoil(pair.wires[1])
        assert pair.guard.look(pair.now)
        assert pair.fault.startswith("node 1: ")

    def test_a_drive_that_has_a_fault_or_was_never_heard_is_not_armed(self, pair: Pair) -> None:
        pair.beat(IDLE, IDLE, error=AxisError.DRV_FAULT)
        assert pair.guard.refusal(pair.now) == "node 0: DRV_FAULT"
        guard = Guard([OdriveAxis(0, lambda _: None, SimulatedClock())])
        guard.begin(50.0)
        assert guard.refusal(50.0) == "node 0: no heartbeat yet"


class TestOff:
    """A drive is off when it has said so itself, and not when it was told to be."""

    @pytest.fixture
    def told(self, driven: Pair) -> Pair:
        """Both drives are in closed loop, and have just been told to be off."""
        driven.guard.disarm()
        driven.guard.ordered_off(driven.now)
        return driven

    def test_it_is_off_once_every_drive_has_said_so(self, told: Pair) -> None:
        assert not told.guard.off, "what they said before the order proves nothing"
        told.pass_time(0.05, IDLE, CLOSED)
        assert not told.guard.off
        told.pass_time(0.05, IDLE, IDLE)
        assert told.guard.off
        assert told.guard.fault is None
        told.guard.ordered_off(told.now)
        told.now += HEARTBEAT_TIMEOUT + 1.0
        told.guard.look(told.now)
        assert not told.guard.off, "nor does silence"

    def test_the_order_is_repeated_while_a_drive_says_that_it_is_on(self, told: Pair) -> None:
        orders = []
        for _ in range(100):
            if told.hear(IDLE, CLOSED, after=0.01):
                orders.append(told.now)
        assert len(orders) == pytest.approx(1.0 / OFF_PERIOD, abs=1)
        assert not told.pass_time(1.0, IDLE, IDLE)

    def test_a_drive_that_stays_on_is_a_fault_of_its_own(self, told: Pair) -> None:
        told.pass_time(OBEY_TIMEOUT - 0.1, IDLE, CLOSED)
        assert told.guard.fault is None
        told.pass_time(0.2, IDLE, CLOSED)
        assert told.fault == "node 1: it is on, though it was ordered to be off: cut the power of its motor"
        told.pass_time(1.0, IDLE, IDLE)
        assert told.guard.off
        assert told.guard.refusal(told.now) == told.guard.fault, "a person must see it and clear it"
        told.guard.begin(told.now)
        told.pass_time(1.0, IDLE, IDLE)
        assert told.guard.refusal(told.now) is None

    def test_what_an_axis_believes_after_an_order_does_not_count(self, told: Pair) -> None:
        for _ in range(20):
            told.now += 0.05
            if told.now * 10 % 1 < 0.5:  # a heartbeat each 0.1 s
                told.beat(IDLE, CLOSED)
            if told.guard.look(told.now):
                for wire in told.wires:
                    wire.axis.idle()
        assert "node 1: it is on, though" in told.fault

    def test_it_takes_the_place_of_what_has_latched_before(self, driven: Pair) -> None:
        """The interface was down: the order to be off was lost, and the heartbeats were missed first."""
        driven.now += HEARTBEAT_TIMEOUT + 0.1
        assert driven.guard.look(driven.now)
        assert "no heartbeat" in driven.fault
        driven.now += 1.0
        assert driven.pass_time(0.1, CLOSED, CLOSED), "told again as soon as it is heard again"
        assert "no heartbeat" in driven.fault
        driven.pass_time(OBEY_TIMEOUT + 0.1, CLOSED, CLOSED)
        assert "it is on, though" in driven.fault


class TestOwnWords:
    """What proves that a motor is off is the drive's word on its motor, and nothing else."""

    @pytest.mark.parametrize(
        ("state", "error"),
        [
            (AxisState.LOCKIN_SPIN, 0),
            (AxisState.MOTOR_CALIBRATION, 0),
            (CLOSED, AxisError.MOTOR_OVER_TEMP),
            (CLOSED, AxisError.ESTOP_REQUESTED),
        ],
    )
    def test_a_fault_or_an_estop_is_not_off(self, pair: Pair, state: AxisState, error: int) -> None:
        pair.guard.ordered_off(pair.now)
        orders = 0
        for _ in range(20):
            pair.now += 0.1
            pair.wires[0].beat(IDLE, 0, pair.now)
            pair.wires[1].beat(state, error, pair.now)
            orders += pair.guard.look(pair.now)
        assert not pair.guard.off
        assert orders >= 5
        assert pair.fault == "node 1: it is on, though it was ordered to be off: cut the power of its motor"

    def test_one_that_is_armed_and_says_nothing_of_its_motor_is_a_fault(self, driven: Pair) -> None:
        for _ in range(8):
            driven.now += 0.1
            for wire in driven.wires:
                wire.axis.heard = driven.now
            driven.guard.look(driven.now)
        assert "it has not reported for 0.5 s whether its motor is on" in driven.fault

    def test_one_that_falls_silent_altogether_is_told_by_its_heartbeat(self, driven: Pair) -> None:
        for wire in driven.wires:
            wire.axis.heard = driven.now + 0.09  # a last heartbeat, after its last word on its motor
        for _ in range(70):
            driven.now += 0.01
            driven.guard.look(driven.now)
        assert "no heartbeat for 0.5 s" in driven.fault


class TestProof:
    """Before a robot is armed for the first time, each drive's own watchdog must stop its motor once."""

    @pytest.fixture
    def asked(self, pair: Pair) -> Pair:
        """The player has armed a robot that was just connected, and its drives have obeyed."""
        pair.start(CLOSED, CLOSED)
        return pair

    def expire(self, pair: Pair, *nodes: int) -> None:
        pair.now += 0.1
        for wire in pair.wires:
            stopped = wire.axis.node in nodes
            wire.beat(IDLE if stopped else CLOSED, AxisError.WATCHDOG_TIMER_EXPIRED if stopped else 0, pair.now)
        pair.guard.look(pair.now)

    def test_it_is_not_armed_before_and_ready_when_every_watchdog_has_expired(self, asked: Pair) -> None:
        assert asked.guard.armed_by_player
        assert asked.guard.proving
        assert not asked.guard.armed
        self.expire(asked, 0)
        assert not asked.guard.rearm_pending
        self.expire(asked, 0, 1)
        assert asked.guard.rearm_pending
        assert asked.guard.fault is None
        asked.arm()
        assert asked.guard.armed
        assert not asked.guard.proving

    def test_a_drive_without_a_watchdog_is_tried_twice_and_then_refused(self, asked: Pair) -> None:
        assert asked.pass_time(PROOF_TIMEOUT + 0.1, CLOSED, CLOSED)
        assert asked.guard.fault is None
        assert asked.guard.rearm_pending, "once more, as this computer may have been late"
        asked.pass_time(0.1, IDLE, IDLE)
        assert asked.guard.off
        asked.guard.arm(asked.now)
        asked.pass_time(0.05, CLOSED, CLOSED)
        self.expire(asked, 0)
        assert asked.pass_time(PROOF_TIMEOUT + 0.1, CLOSED, CLOSED)
        assert asked.fault.startswith("node 1: its own watchdog has not stopped it within 0.33 s")
        assert 'watchdog = "unsafe"' in asked.fault
        assert not asked.guard.armed

    def test_a_watchdog_that_is_too_slow_is_no_proof(self, asked: Pair) -> None:
        asked.pass_time(PROOF_TIMEOUT, CLOSED, CLOSED)
        self.expire(asked, 0, 1)
        assert asked.guard.proof.pending

    def test_an_expiry_of_before_that_is_told_once_more_is_no_proof(self, pair: Pair) -> None:
        pair.guard.arm(pair.now)
        for wire in pair.wires:
            wire.axis.start()
        for _ in range(3):
            pair.hear(IDLE, IDLE, error=AxisError.WATCHDOG_TIMER_EXPIRED, after=0.05)
        pair.pass_time(0.1, CLOSED, CLOSED)
        assert pair.guard.withholding
        assert pair.guard.proof.pending
        assert not pair.guard.rearm_pending

    def test_setpoints_are_withheld_only_once_every_motor_is_on(self, pair: Pair) -> None:
        pair.start(CLOSED, IDLE)
        assert pair.guard.proving
        assert not pair.guard.withholding
        pair.pass_time(0.1, CLOSED, CLOSED)
        assert pair.guard.withholding

    def test_what_a_drive_said_before_is_no_proof(self, pair: Pair) -> None:
        pair.beat(IDLE, IDLE, error=AxisError.WATCHDOG_TIMER_EXPIRED)
        pair.start(CLOSED, CLOSED)
        assert not pair.guard.rearm_pending

    def test_it_is_proved_anew_after_a_recovery_and_not_after_an_estop(self, asked: Pair) -> None:
        self.expire(asked, 0, 1)
        asked.guard.engage()
        assert not asked.guard.rearm_pending, "the player must arm it again"
        asked.guard.release(asked.now)
        assert not asked.guard.proof.pending
        asked.guard.begin(asked.now)
        assert asked.guard.proof.pending

    def test_an_estop_ends_it(self, asked: Pair) -> None:
        asked.guard.engage()
        self.expire(asked, 0, 1)
        assert not asked.guard.rearm_pending
        assert not asked.guard.armed_by_player

    def test_an_estop_at_a_drive_ends_what_was_proved(self, asked: Pair) -> None:
        self.expire(asked, 0, 1)
        assert asked.guard.rearm_pending
        asked.hear(IDLE, IDLE, error=AxisError.ESTOP_REQUESTED, after=0.1)
        assert not asked.guard.rearm_pending, "nobody has asked for it since"

    def test_a_robot_that_a_person_has_called_unsafe_is_armed_at_once(self, pair: Pair) -> None:
        for wire in pair.wires:
            wire.axis.unwatched = True
        pair.guard.begin(pair.now)
        pair.start(CLOSED, CLOSED)
        assert pair.guard.armed


class TestLacks:
    """What a drive that is alive may not be silent about."""

    def test_a_supply_that_no_battery_of_the_wiring_can_have_is_a_fault_of_a_robot_that_is_armed(self) -> None:
        pair = Pair(20.0, 25.2)

        def low(volts: float, seconds: float, state: int) -> None:
            for pause in (seconds, 0.1):
                pair.wires[1].hear(messages.BusVoltageCurrent(volts, 0.0), pair.now)
                pair.pass_time(pause, state, state)

        low(0.0, 3.0, IDLE)
        assert pair.guard.fault is None, "somebody may have cut the power of motors that are off"
        pair.guard.proof.pending = False
        pair.arm()
        pair.pass_time(0.2, CLOSED, CLOSED)
        for volts, seconds in ((12.0, 0.5), (24.0, 0.1), (17.0, 3.0)):
            low(volts, seconds, CLOSED)
        assert pair.guard.fault is None, "it may be low for a moment, and a battery may be a little below empty"
        low(12.0, 1.1, CLOSED)
        assert pair.fault == (
            "node 1: its supply has 12 V, where an empty battery has 20 V: is the emergency switch released? Charge "
            "or change the battery, or correct `supply` in the wiring of this robot"
        )

    def test_a_supply_that_no_full_battery_has(self) -> None:
        pair = Pair(20.0, 25.2)
        pair.arm()
        for volts, seconds in ((60.0, 0.5), (24.0, 1.0), (30.0, 3.0)):
            for _ in range(round(seconds / 0.1)):
                pair.wires[1].hear(messages.BusVoltageCurrent(volts, 0.0), pair.now)
                pair.pass_time(0.1, CLOSED, CLOSED)
        assert pair.guard.fault is None, "motors that brake give back, and a charger may be on it"
        for _ in range(12):
            pair.wires[1].hear(messages.BusVoltageCurrent(60.0, 0.0), pair.now)
            pair.pass_time(0.1, CLOSED, CLOSED)
        assert "node 1: its supply has 60 V, where a full battery has 25.2 V" in pair.fault

    def test_a_supply_that_is_low_most_of_the_time_is_not_forgotten_for_one_good_value(self) -> None:
        pair = Pair(20.0, 25.2)
        pair.arm()
        for tick in range(100):
            pair.wires[1].hear(messages.BusVoltageCurrent(24.0 if tick % 20 < 2 else 12.0, 0.0), pair.now)
            pair.pass_time(0.05, CLOSED, CLOSED)
            if pair.fault:
                break
        assert "node 1: its supply has 12 V" in pair.fault

    @pytest.mark.parametrize(("pause", "latches"), [(1.0, True), (DROPOUT_WINDOW, False)])
    def test_a_drive_that_is_not_heard_again_and_again_has_a_loose_plug(
        self, driven: Pair, pause: float, latches: bool
    ) -> None:
        for _ in range(DROPOUTS):
            assert not driven.guard.fault
            driven.arm()
            driven.pass_time(pause, CLOSED, CLOSED)
            for _ in range(6):
                driven.now += 0.05
                driven.wires[0].beat(CLOSED if driven.guard.armed_by_player else IDLE, 0, driven.now)
                driven.guard.look(driven.now)
            assert driven.fault or driven.guard.disarmed_because == (
                "node 1: nothing was heard from it for 0.2 s: check its wires and its plug."
            )
            driven.pass_time(0.05, IDLE, IDLE)
        assert ("node 1: its frames or its setpoints were lost 3 times" in driven.fault) == latches

    def test_an_encoder_that_is_silent_is_missed_also_on_a_computer_that_hiccups(self, driven: Pair) -> None:
        """What this process did not hear is excused once, and only for what is heard again."""
        began = driven.now
        while not driven.fault and driven.now - began < 3.0:
            for _ in range(3):
                driven.now += 0.05
                driven.wires[0].beat(CLOSED, 0, driven.now)
                Wire.beat(driven.wires[1], CLOSED, 0, driven.now)  # its heartbeats alone
                driven.guard.start.command(driven.now)
                driven.guard.look(driven.now)
            driven.now += 0.12
            driven.guard.catch_up(driven.now)
        assert "node 1: no encoder message for 0.5 s" in driven.fault
        assert driven.now - began < 1.5

    @pytest.mark.parametrize("late", [False, True])
    def test_a_watchdog_that_expires_again_and_again(self, driven: Pair, late: bool) -> None:
        """Setpoints get lost, unless it is this computer that was late with them."""
        driven.arm()
        for _ in range(DROPOUTS):
            for _ in range(10):
                driven.guard.start.command(driven.now)
                driven.pass_time(0.05, CLOSED, CLOSED)
            driven.now += 0.4 if late else 0.06
            driven.guard.catch_up(driven.now)
            driven.hear(CLOSED, IDLE, error=AxisError.WATCHDOG_TIMER_EXPIRED)
            assert not driven.guard.armed_by_player
            driven.beat()
            if not driven.fault:
                driven.arm()
        assert ("its setpoints were lost" in driven.fault) != late

    def test_a_drive_that_hears_no_orders_is_told_of_after_three_starts(self, driven: Pair) -> None:
        starts = 0
        while driven.guard.fault is None:
            starts += 1
            assert starts < 10
            driven.guard.arm(driven.now)
            for _ in range(20):
                driven.now += 0.05
                driven.wires[0].beat(CLOSED, 0, driven.now)
                driven.wires[1].beat(IDLE, AxisError.WATCHDOG_TIMER_EXPIRED, driven.now)
                driven.guard.look(driven.now)
        assert starts == FAILED_STARTS
        assert "node 1: it was ordered 3 times to start" in driven.fault
        assert "Check the wires" in driven.fault

    def test_a_motor_that_does_not_start_on_a_busy_computer_is_not_to_blame(self, pair: Pair) -> None:
        pair.guard.arm(pair.now)
        pair.guard.start.command(pair.now + 0.5)
        pair.pass_time(START_TIMEOUT + 0.1)
        assert "node 0: expected closed-loop control, but it is idle: this computer is too busy" in pair.fault

    def test_a_computer_that_was_busy_long_ago_is_not_to_blame(self, pair: Pair) -> None:
        pair.arm()
        pair.guard.start.command(pair.now + 0.5)
        for _ in range(60):
            pair.guard.start.command(pair.now + 0.05)
            pair.hear(CLOSED, CLOSED, after=0.05)
        pair.pass_time(0.1, IDLE, CLOSED)
        assert "but it is idle and gives no reason: does it hear this computer" in pair.fault


class TestIdentity:
    """The serial numbers of the drives."""

    @pytest.fixture
    def met(self) -> Pair:
        pair = Pair()
        for wire in pair.wires:
            wire.hear(messages.Address(wire.axis.node, 0xA0 + wire.axis.node), pair.now)
        pair.guard = Guard([wire.axis for wire in pair.wires])
        pair.guard.begin(pair.now)
        return pair

    def test_after_a_recovery_each_drive_says_anew_who_it_is(self, met: Pair) -> None:
        assert met.guard.refusal(met.now) is None
        for wire in met.wires:
            wire.axis.forget()
        met.guard.begin(met.now)
        assert met.guard.refusal(met.now) == "node 0: it has not said yet which drive it is"
        for wire in met.wires:
            wire.hear(messages.Address(wire.axis.node, 0xA0 + wire.axis.node), met.now)
        met.pass_time(0.1)
        assert met.guard.refusal(met.now) is None

    def test_another_drive_is_not_driven(self, met: Pair) -> None:
        met.wires[1].axis.forget()
        met.wires[1].hear(messages.Address(1, 0xA0), met.now)
        met.guard.begin(met.now)
        met.pass_time(0.1)
        assert "node 1: its drive has serial number A0, expected A1: were ids or plugs swapped" in met.fault

    def test_one_that_says_late_who_it_is_is_expected_from_then_on(self) -> None:
        met = Pair()
        met.pass_time(2.0)
        for who in (0xA1, 0xB0):
            assert met.fault == ""
            met.wires[1].hear(messages.Address(1, who), met.now)
            met.pass_time(0.1)
            met.wires[1].axis.forget_serials()
        assert "node 1: its drive has serial number B0, expected A1" in met.fault

    def test_a_second_drive_of_an_id_is_named_whatever_has_latched_before(self, met: Pair) -> None:
        met.guard.latch("node 1: its position jumped")
        met.wires[1].hear(messages.Address(1, 0xB0), met.now)
        met.pass_time(0.1)
        assert met.fault == "node 1: two drives have this id: serial numbers A1 and B0; give one another id"
