"""One axis of a CiA 402 drive, over CANopen.

Until `prepare` is done, the drive is asked and set up by SDO transfers, which canopen does. After that everything is a
PDO: nothing waits, and a setpoint is one frame.

What feeds the drive's watchdog is the second RPDO, which carries the target velocity alone, or where the drive watches
its master the heartbeat that goes with it. Only `start` and `command` send them. The first RPDO, the controlword, has
no deadline. So the receive thread may carry a start that was asked for through the three steps of the state machine,
each as soon as the drive has confirmed the last, without ever feeding the watchdog. By CiA 301 that watchdog begins
with the first setpoint after it was set. `start` therefore sends one before any controlword, and no step is taken once
the newest setpoint is older than the deadline: a player that freezes in the midst of a start leaves no motor switched
on without a watchdog.
"""

from collections.abc import Mapping

from vrg.hal.can.axis import NEVER, Axis, MotorState, ProtocolOptions, Send
from vrg.hal.can.frame import STANDARD_MASK, Filter, Frame, FrameError
from vrg.hal.clock import MonotonicClock
from vrg_drives.cia402 import codec
from vrg_drives.cia402.codec import Control, DriveState, Function, Nmt, NmtCommand, Object
from vrg_drives.cia402.errors import HEARTBEAT_LOST, RPDO_TIMEOUT, STO_CODES, describe_error
from vrg_drives.cia402.interview import Interview
from vrg_drives.cia402.sdo import SdoClient
from vrg_drives.cia402.set_up import DEADLINE, HEARTBEAT, SetUp
from vrg_drives.cia402.units import Cia402Options, Units

_NEXT = {
    DriveState.SWITCH_ON_DISABLED: Control.SHUTDOWN,
    DriveState.READY_TO_SWITCH_ON: Control.SWITCH_ON,
    DriveState.SWITCHED_ON: Control.ENABLE_OPERATION,
    DriveState.QUICK_STOP_ACTIVE: Control.DISABLE_VOLTAGE,
}
"""The controlword that brings a drive in this state nearer to operation."""
_STATUS_PERIOD = 0.1
"""s from one question for the statusword to the next."""
_SUPPLY_PERIOD = 1.5
"""s from one question for the supply's voltage to the next."""
_COMMANDS = (Function.RPDO1, Function.RPDO2, Function.RPDO3, Function.RPDO4)


class Cia402Axis(Axis):
    """See `Axis` and the module. `fault` is the drive's error code in words, while its statusword reports a fault."""

    options: Cia402Options
    options_type = Cia402Options

    def __init__(self, node: int, send: Send, clock: MonotonicClock, options: ProtocolOptions | None = None) -> None:
        super().__init__(node, send, clock, options)
        self._sdo = SdoClient(node, send, clock)
        self._interview = Interview(self._sdo, round(HEARTBEAT * 1000), self.options, clock)
        self._units = Units(1.0, 1.0)
        self._prepared = self._settled = False
        self._asks_supply = False
        self._master: int | None = None
        self._asked_supply = self._asked_status = NEVER
        self._nmt: int | None = None
        self._status: DriveState | None = None
        self._word = int(Control.DISABLE_VOLTAGE)
        self._wanted = self._starting = self._late = False
        self._now = self._setpoint_at = NEVER

    @classmethod
    def check_node(cls, node: int) -> str | None:
        """A drive has an id from 1 to 127."""
        return None if node in codec.NODE_IDS else f"expected 1 to {codec.NODE_IDS[-1]}, got {node}"

    @classmethod
    def check_output(cls, bit: int) -> str | None:
        """CiA 402 leaves the bits 16 to 31 of 0x60FE to the maker's digital outputs."""
        return None if bit in codec.OUTPUT_BITS else f"expected 16 to 31 (bits of 0x60FE), got {bit}"

    @property
    def filters(self) -> list[Filter]:
        """They let all frames from and to this node through, and orders to all, so that another master is noticed."""
        return [
            Filter(self.node, codec.NODE_MASK),
            Filter(Function.NMT, STANDARD_MASK),
            Filter(codec.LSS, STANDARD_MASK),
        ]

    @property
    def identified(self) -> bool:
        """True if all questions are answered, or if one of the answers is a problem."""
        return self._interview.complete or self.problem is not None

    @property
    def problem(self) -> str | None:
        """No drive of profile 402 that knows profile velocity, units that make no sense, or two drives with this id."""
        return self._interview.problem

    def receive(self, frame: Frame) -> None:
        """Hear a frame."""
        if frame.extended or frame.fd or frame.remote:
            return
        if frame.id == codec.LSS:
            if frame.data and frame.data[0] in codec.LSS_ORDERS:
                self._complain("another program gives nodes other ids or bit rates (LSS)")
            return
        if frame.id == Function.NMT:
            if len(frame.data) == 2 and frame.data[1] in (0, self.node):
                self._complain("another program commands its network state")
            return
        if frame.id & codec.NODE_MASK != self.node:
            return
        self._now = max(self._now, frame.at)
        function = frame.id & ~codec.NODE_MASK
        try:
            self._take(function, frame)
        except FrameError as error:
            self._complain(f"a malformed frame: {error}")

    def identify(self, patience: float) -> None:
        """Ask the questions that have no answer yet, one after the other, as a drive answers one at a time.

        Args:
            patience: s to wait in all.
        """
        if self._nmt == Nmt.STOPPED:
            self._send(codec.nmt(self.node, NmtCommand.PRE_OPERATIONAL))  # a stopped node answers no SDO
        self._interview.ask(patience)

    def ask_serial(self) -> None:
        """Ask for the serial number, unless canopen asks for something else, to which the answer would not fit."""
        if not self._sdo.asking:
            self._send(codec.upload(self.node, Object.IDENTITY, codec.SERIAL_NUMBER))

    def forget_serials(self) -> None:
        """Let the drive say again who it is."""
        super().forget_serials()
        self._sdo.serials.clear()

    def forget(self) -> None:
        """Let the drive say again who and what it is."""
        super().forget()
        self._prepared = self._settled = False
        self._sdo.serial_answers = 0
        self._interview = Interview(self._sdo, round(HEARTBEAT * 1000), self.options, self._clock)

    @property
    def traits(self) -> Mapping[str, str]:
        """Its firmware and its units."""
        return {**super().traits, "units": str(self._units)}

    def prepare(self) -> None:
        """Set up PDOs, the watchdog and the mode of operation; waits for the drive's answers.

        Raises:
            RobotError: it refuses, or does not answer.
        """
        self._units = self._interview.units or self._units
        self.wrap = self._units.wrap
        self._prepared = self._settled = self._wanted = False
        self._word = int(Control.DISABLE_VOLTAGE)
        set_up = SetUp(self.node, self._sdo, self._send, self._clock, unwatched=self.unwatched, outputs=self.outputs)
        set_up.configure()
        self.firmware = set_up.firmware
        self._asks_supply = not set_up.tells_supply
        self._master = set_up.master
        self._prepared = True
        self.fault, self.state = None, MotorState.IDLE
        set_up.begin()
        self._nmt = Nmt.OPERATIONAL
        set_up.wait_for_mode()
        self._settled = True

    def poll(self, now: float) -> None:
        """Ask for the supply's voltage where no PDO can carry it, and how a drive is whose PDOs are off."""
        if self._cut_off and not self._sdo.asking and now - self._asked_status > _STATUS_PERIOD:
            self._asked_status = now
            self._send(codec.upload(self.node, Object.STATUSWORD))
        if self._asks_supply and not self._sdo.asking and now - self._asked_supply > _SUPPLY_PERIOD:
            self._asked_supply = now
            self._send(codec.upload(self.node, Object.VOLTAGE))

    def start(self) -> None:
        """Ask for operation; the rest is done as the drive confirms each step."""
        self._wanted, self._starting, self._late = True, True, False
        self.expiry_reported = False
        self.command(0.0)
        if self.state is MotorState.IDLE:
            self.state = MotorState.STARTING
        self._step()

    def command(self, velocity: float) -> None:
        """Send a setpoint in turn/s."""
        self._setpoint_at = self._now
        if self._master is not None:
            self._send(Frame(Function.HEARTBEAT | self._master, bytes([Nmt.OPERATIONAL])))
        self._send(codec.SETPOINT_PDO.frame(self.node, self._units.velocity_of(velocity)))

    def output(self, bits: int) -> None:
        """Send the outputs by their own PDO, which feeds no watchdog."""
        self._send(codec.OUTPUT_PDO.frame(self.node, bits))

    def idle(self) -> None:
        """Switch the motor off. To disable the voltage works in every state, and needs nothing but the output stage.

        In an emergency a quick stop would brake along a ramp, by the same controller that may be its reason.
        """
        self._wanted = self._late = False
        if self.state in (MotorState.STARTING, MotorState.CLOSED_LOOP):
            self.state = MotorState.IDLE
        self._control(Control.DISABLE_VOLTAGE)
        if self._cut_off and not self._sdo.asking:
            # It hears no PDO, and its watchdog is one of a PDO.
            self._send(codec.download(self.node, Object.CONTROLWORD, Control.DISABLE_VOLTAGE, 2), urgent=True)

    @property
    def _cut_off(self) -> bool:
        """True if the drive was set up wholly, and is in a network state in which its PDOs are off.

        While it is set up its PDOs are off too, and a question of this axis would meet the answers to those of the
        set-up.
        """
        return self._settled and self._nmt not in (None, Nmt.OPERATIONAL, Nmt.BOOTED)

    def clear(self) -> None:
        """Send a fault reset, which is the rising edge of bit 7."""
        self._late = False
        if self._word & Control.FAULT_RESET:
            self._control(Control.DISABLE_VOLTAGE)
        self._control(Control.FAULT_RESET)

    def _take(self, function: int, frame: Frame) -> None:
        if function == Function.HEARTBEAT:
            self._heartbeat(frame)
        elif function == Function.SDO_ANSWER:
            if not self._sdo.asking and codec.concerns(frame.data, Object.VOLTAGE):
                self._take_supply(frame)
            elif not self._sdo.asking and codec.concerns(frame.data, Object.STATUSWORD):
                self._take_status(codec.uploaded(frame.data) or 0, frame.at)
            self._sdo.hear(frame.data)
            self.serials |= {f"{serial:X}" for serial in self._sdo.serials if serial}
        elif function in _COMMANDS:
            # Frames that this master sends are not received by it, so these are another master's.
            self._complain("another program commands it too")
        elif function == Function.SDO_REQUEST and frame.data and frame.data[0] & 0xE0 in codec.SDO_DOWNLOADS:
            self._complain("another program sets it up too")
        elif self._prepared:
            # Before that, what its PDOs carry is unknown.
            self._telegram(function, frame)

    def _telegram(self, function: int, frame: Frame) -> None:
        if function == Function.EMCY:
            if len(frame.data) != 8:
                raise FrameError(f"EMCY: expected 8 bytes, got {len(frame.data)}")
            if int.from_bytes(frame.data[:2], "little") in STO_CODES:
                # A button at the drive: it is off from this moment, before its statusword shows it.
                self.state, self._wanted = MotorState.ESTOP, False
        elif function == Function.TPDO1:
            status, error, mode = codec.STATUS_PDO.values(frame.data)
            if self._settled and mode != codec.PROFILE_VELOCITY:
                self._complain(
                    f"its mode of operation (0x6061) is {mode}, expected {codec.PROFILE_VELOCITY}, profile velocity: "
                    "was it changed by another program, or at the drive?"
                )
            self._take_status(status, frame.at)
            self._judge(status, error)
        elif function == Function.TPDO2:
            position, velocity = codec.MOTION_PDO.values(frame.data)
            self._estimate(self._units.turns(position), self._units.turns_per_s(velocity), frame.at)
        elif function == Function.TPDO3:
            (millivolts,) = codec.SUPPLY_PDO.values(frame.data)
            self._supply(millivolts / 1000, frame.at)

    def _take_status(self, statusword: int, at: float) -> None:
        """Take in the state of the motor from a statusword."""
        self._status = codec.drive_state(statusword)
        self._report_on(self._status in codec.POWERED or self._status is DriveState.FAULT_REACTION_ACTIVE, at)

    def _take_supply(self, frame: Frame) -> None:
        """The answer to the question for the supply's voltage."""
        millivolts = codec.uploaded(frame.data)
        if millivolts is None:
            self._asks_supply = False  # it has no such object
        else:
            self._supply(millivolts / 1000, frame.at)

    def _heartbeat(self, frame: Frame) -> None:
        if len(frame.data) != 1:
            raise FrameError(f"heartbeat: expected 1 byte, got {len(frame.data)}")
        if frame.data[0] not in codec.NMT_WORDS:
            raise FrameError(f"heartbeat: expected a network state, got 0x{frame.data[0]:02X}")
        self.heard, self._nmt = frame.at, frame.data[0]
        if self._nmt == Nmt.BOOTED and self._prepared:
            self._complain("it was started again")
        if self._settled and self._nmt != Nmt.OPERATIONAL:
            # It hears no setpoint now, and after a start it has forgotten its set-up. At the end of the set-up a
            # heartbeat of before may still be under way.
            self.state, self._wanted = MotorState.FAULT, False
            words = codec.NMT_WORDS[self._nmt]
            self.fault = f"expected the network state operational, it is {words}: it must be set up again"
        elif self.state is MotorState.SILENT:
            self.state = MotorState.IDLE

    def _judge(self, statusword: int, error: int) -> None:
        """Judge a statusword, and take the next step of a start."""
        state = self._status
        faulty = state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
        # Some drives take the end of the setpoints for an error even when they hold still; it is no fault there either.
        timed_out = faulty and error in (RPDO_TIMEOUT, HEARTBEAT_LOST)
        self.fault = None
        if state is None:
            self.fault = f"expected a state of CiA 402, its statusword is 0x{statusword:04X}"
        elif faulty and not timed_out and error not in STO_CODES:
            self.fault = describe_error(error) or "a fault that it gives no reason for"
        if self.fault or (faulty and not timed_out):
            self.state, self._wanted = MotorState.FAULT if self.fault else MotorState.ESTOP, False
        else:
            enabled = state is DriveState.OPERATION_ENABLED
            if enabled and self._word == Control.ENABLE_OPERATION:
                # A drive that leaves this state by itself later on is not brought back: that was not ordered.
                self._starting = False
            if enabled:
                self.state = MotorState.CLOSED_LOOP
            if not faulty:
                self._step()
            starting = self._wanted and self._starting and not (timed_out or self._late)
            self.state = MotorState.CLOSED_LOOP if enabled else MotorState.STARTING if starting else MotorState.IDLE
        self.watchdog_expired = timed_out or self._late
        self.expiry_reported |= timed_out

    def _step(self) -> None:
        """Send the next controlword on the way to where this axis is to be, if there is one."""
        if not self._wanted:
            if self._status in codec.POWERED or self._word & Control.FAULT_RESET:
                self._control(Control.DISABLE_VOLTAGE)
        elif self._starting and self._status in _NEXT and not self._late:
            self._late = self._now - self._setpoint_at > DEADLINE
            if not self._late:
                self._control(_NEXT[self._status])

    def _control(self, word: int) -> None:
        self._word = word
        self._send(codec.CONTROL_PDO.frame(self.node, word), urgent=word == Control.DISABLE_VOLTAGE)
