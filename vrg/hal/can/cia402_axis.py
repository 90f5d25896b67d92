"""One axis of a CiA 402 drive, over CANopen.

Until `prepare` is through, SDO transfers set the drive up; canopen does them. After that everything is PDO: nothing
waits, and a setpoint is one frame.

What feeds the drive's watchdog is the second RPDO, the target velocity alone, which `start` and `command` send and
nobody else. The first, the controlword, has no deadline. So the receive thread may carry a start that the player has
asked for through the state machine's three steps, each as soon as the drive has confirmed the last, without ever
feeding the watchdog. By CiA 301 that watchdog begins with the first setpoint after it was set; `start` therefore sends
one before any controlword, and no step is taken once the newest setpoint is older than the deadline: a player that
freezes in the midst of a start leaves no motor switched on without a watchdog.
"""

import struct
import time
from collections.abc import Callable

import can
import canopen

from vrg.errors import RobotError
from vrg.hal.can import cia402
from vrg.hal.can.axis import NEVER, Axis, State
from vrg.hal.can.cia402 import Control, DriveState, Function, Nmt, NmtCommand, Object, Pdo
from vrg.hal.can.frame import STANDARD_MASK, Frame, FrameError
from vrg.hal.robot import COMMAND_TIMEOUT

DEADLINE = COMMAND_TIMEOUT
"""s without a setpoint after which the drive stops the motor."""
HEARTBEAT = 0.1
"""s between heartbeats."""
SDO_TIMEOUT = 0.5
"""s for the answer to one request."""
_MODE_TRIES, _MODE_PAUSE = 50, 0.01
"""For the drive to take a mode of operation."""
_NEXT = {
    DriveState.SWITCH_ON_DISABLED: Control.SHUTDOWN,
    DriveState.READY_TO_SWITCH_ON: Control.SWITCH_ON,
    DriveState.SWITCHED_ON: Control.ENABLE_OPERATION,
    DriveState.QUICK_STOP_ACTIVE: Control.DISABLE_VOLTAGE,
}
"""The controlword that brings a drive in this state nearer to operation."""
_POWERED = (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
_COMMANDS = (Function.RPDO1, Function.RPDO2, Function.RPDO3, Function.RPDO4)
_MISSING = range(0x0602_0000, 0x060A_0000)
"""SDO abort codes for what a drive does not have."""


class Cia402Axis(Axis):
    """See `Axis` and the module. `fault` is what the drive says when its statusword says that it has one."""

    protocol = "cia402"

    def __init__(self, node: int, send: Callable[[Frame], None]) -> None:
        super().__init__(node, send)
        self._interview = cia402.Interview(round(HEARTBEAT * 1000))
        self._units = cia402.Units(1.0, 1.0)
        self._preparing = self._prepared = False
        self._nmt: int | None = None
        self._status: DriveState | None = None
        self._word = int(Control.DISABLE_VOLTAGE)
        self._wanted = self._starting = self._late = False
        self._now = self._setpoint_at = NEVER
        self._network = canopen.Network()
        self._network.bus = _Sender(self._send)  # type: ignore[assignment]
        self._drive = canopen.RemoteNode(self.node, cia402.object_dictionary(self.node))
        self._network.add_node(self._drive)
        self._drive.sdo.RESPONSE_TIMEOUT = SDO_TIMEOUT

    @classmethod
    def check_node(cls, node: int) -> str | None:
        """1 to 127."""
        return None if node in cia402.NODES else f"expected 1 to {cia402.NODES[-1]}, got {node}"

    @property
    def filters(self) -> list[tuple[int, int]]:
        """All frames from and to this node, and NMT commands, so that another master is noticed."""
        return [(self.node, cia402.NODE_MASK), (Function.NMT, STANDARD_MASK)]

    @property
    def identified(self) -> bool:
        """All questions are answered, or one of the answers is a problem."""
        return self._interview.complete or self.problem is not None

    @property
    def problem(self) -> str | None:
        """No drive of profile 402 that knows profile velocity, units that make no sense, or two drives with this id."""
        return self._interview.problem

    def receive(self, frame: Frame) -> None:
        """Hear a frame."""
        if frame.extended or frame.remote:
            return
        if frame.id == Function.NMT:
            if len(frame.data) == 2 and frame.data[1] in (0, self.node):
                self._complain("another program commands its network state")
            return
        if frame.id & cia402.NODE_MASK != self.node:
            return
        self._now = max(self._now, frame.at)
        function = frame.id & ~cia402.NODE_MASK
        try:
            self._take(function, frame)
        except FrameError as error:
            self._complain(f"a malformed frame: {error}")

    def identify(self) -> None:
        """Ask the first question that has no answer yet; each answer brings the next one."""
        if self._nmt == Nmt.STOPPED:
            self._send(cia402.nmt(self.node, NmtCommand.PRE_OPERATIONAL))  # a stopped node answers no SDO
        for question in self._interview.next(self.node):
            self._send(question)

    def prepare(self) -> None:
        """Set up PDOs, the watchdog and the mode of operation; waits for the drive.

        Raises:
            RobotError: it refuses, or does not answer.
        """
        self._units = self._interview.units or self._units
        self.serial = self._interview.serial
        self.wrap = self._units.wrap
        self._prepared, self._wanted, self._preparing = False, False, True
        try:
            self._set_up()
        except canopen.SdoAbortedError as error:
            raise RobotError(f"node {self.node}: the drive refuses to be set up: {error}") from None
        except (canopen.SdoCommunicationError, canopen.ObjectDictionaryError, struct.error) as error:
            raise RobotError(f"node {self.node}: expected the drive's answers while it is set up: {error}") from None
        finally:
            self._preparing = False

    def start(self) -> None:
        """Ask for operation; the rest is done as the drive confirms each step."""
        self._wanted, self._starting, self._late = True, True, False
        self.command(0.0)
        if self.state is State.IDLE:
            self.state = State.STARTING
        self._step()

    def command(self, velocity: float) -> None:
        """Send a setpoint, turn/s."""
        self._setpoint_at = self._now
        self._send(cia402.SETPOINT_PDO.frame(self.node, self._units.velocity_of(velocity)))

    def idle(self) -> None:
        """Switch the motor off."""
        self._wanted = self._late = False
        if self.state in (State.STARTING, State.CLOSED_LOOP):
            self.state = State.IDLE
        self._control(Control.DISABLE_VOLTAGE)

    def stop_now(self) -> None:
        """Disable voltage: it holds in every state, and needs nothing to work but the drive's output stage.

        A quick stop would brake along a ramp, by the same controller that may be why somebody has pressed the button.
        """
        self.idle()

    def clear(self) -> None:
        """Fault reset, which is the rising edge of bit 7."""
        self._late = False
        if self._word & Control.FAULT_RESET:
            self._control(Control.DISABLE_VOLTAGE)
        self._control(Control.FAULT_RESET)

    def _take(self, function: int, frame: Frame) -> None:
        if function == Function.HEARTBEAT:
            self._heartbeat(frame)
        elif function == Function.SDO_ANSWER:
            if self._preparing:
                self._network.notify(frame.id, bytearray(frame.data), frame.at)
            elif not self._prepared and self._interview.hear(frame.data):
                self.identify()
        elif function in _COMMANDS:
            # Frames that this master sends are not heard by it, so these are somebody else's.
            self._complain("another program commands it too")
        elif function == Function.SDO_REQUEST and frame.data and frame.data[0] & 0xE0 == 0x20:
            self._complain("another program sets it up too")
        elif self._prepared:
            # Before that, what its PDOs carry is unknown.
            self._telegram(function, frame)

    def _telegram(self, function: int, frame: Frame) -> None:
        if function == Function.EMCY:
            if len(frame.data) != 8:
                raise FrameError(f"EMCY: expected 8 bytes, got {len(frame.data)}")
            if int.from_bytes(frame.data[:2], "little") in cia402.STO_CODES:
                # A button at the drive: it is off from this moment, before its statusword says so.
                self.state, self._wanted = State.ESTOP, False
        elif function == Function.TPDO1:
            status, error, _mode = cia402.STATUS_PDO.values(frame.data)
            self._judge(status, error)
        elif function == Function.TPDO2:
            position, velocity = cia402.MOTION_PDO.values(frame.data)
            self._estimate(self._units.turns(position), self._units.turns_per_s(velocity), frame.at)
        elif function == Function.TPDO3:
            (millivolts,) = cia402.SUPPLY_PDO.values(frame.data)
            self.voltage = millivolts / 1000

    def _heartbeat(self, frame: Frame) -> None:
        if len(frame.data) != 1:
            raise FrameError(f"heartbeat: expected 1 byte, got {len(frame.data)}")
        if frame.data[0] not in cia402.NMT_WORDS:
            raise FrameError(f"heartbeat: expected a network state, got 0x{frame.data[0]:02X}")
        self.heard, self._nmt = frame.at, frame.data[0]
        if self._nmt == Nmt.BOOTED and self._prepared:
            self._complain("it was started again")
        if self._prepared and self._nmt != Nmt.OPERATIONAL:
            # It hears no setpoint now, and after a start it has forgotten its set-up.
            self.state, self._wanted = State.FAULT, False
            words = cia402.NMT_WORDS[self._nmt]
            self.fault = f"expected the network state operational, it is {words}: it must be set up anew"
        elif self.state is State.SILENT:
            self.state = State.IDLE

    def _judge(self, statusword: int, error: int) -> None:
        """What a statusword means here, and the next step of a start."""
        state = self._status = cia402.drive_state(statusword)
        faulty = state in (DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE)
        # Some drives take the end of the setpoints for an error even when they hold still; it is no fault there either.
        timed_out = faulty and error == cia402.RPDO_TIMEOUT
        self.fault = None
        if state is None:
            self.fault = f"expected a state of CiA 402, its statusword is 0x{statusword:04X}"
        elif faulty and not timed_out and error not in cia402.STO_CODES:
            self.fault = cia402.describe_error(error) or "a fault that it gives no reason for"
        if self.fault or (faulty and not timed_out):
            self.state, self._wanted = State.FAULT if self.fault else State.ESTOP, False
        else:
            enabled = state is DriveState.OPERATION_ENABLED
            if enabled and self._word == Control.ENABLE_OPERATION:
                # A drive that leaves this state by itself later on is not brought back: nobody has asked for that.
                self._starting = False
            if not faulty:
                self._step()
            starting = self._wanted and self._starting and not (timed_out or self._late)
            self.state = State.CLOSED_LOOP if enabled else State.STARTING if starting else State.IDLE
        self.starved = timed_out or self._late

    def _step(self) -> None:
        """Send the next controlword on the way to where this axis is to be, if there is one."""
        if not self._wanted:
            if self._status in _POWERED or self._word & Control.FAULT_RESET:
                self._control(Control.DISABLE_VOLTAGE)
        elif self._starting and self._status in _NEXT and not self._late:
            self._late = self._now - self._setpoint_at > DEADLINE
            if not self._late:
                self._control(_NEXT[self._status])

    def _control(self, word: int) -> None:
        self._word = word
        self._send(cia402.CONTROL_PDO.frame(self.node, word))

    def _set_up(self) -> None:
        drive = self._drive
        drive.sdo[Object.CONTROLWORD].raw = Control.DISABLE_VOLTAGE
        self._word = int(Control.DISABLE_VOLTAGE)
        # Drives let their PDOs be mapped while they are pre-operational alone.
        self._send(cia402.nmt(self.node, NmtCommand.PRE_OPERATIONAL))
        self.firmware = self._words_of(Object.FIRMWARE)
        drive.sdo[Object.HEARTBEAT_TIME].raw = round(HEARTBEAT * 1000)
        self._map(drive.rpdo[1], cia402.CONTROL_PDO)
        self._map(drive.rpdo[2], cia402.SETPOINT_PDO, every=DEADLINE)
        # The drive sends its statusword whenever that changes, and at least this often. An encoder changes all the
        # time: the inhibit time keeps a drive that takes this for an event from filling the bus.
        self._map(drive.tpdo[1], cia402.STATUS_PDO, every=0.05)
        self._map(drive.tpdo[2], cia402.MOTION_PDO, every=0.01, inhibit=0.01)
        try:
            self._map(drive.tpdo[3], cia402.SUPPLY_PDO, every=1.0, inhibit=0.5)
        except canopen.SdoAbortedError as error:
            if error.code not in _MISSING:
                raise
        deadline = drive.sdo[Object.RPDO + 1][cia402.EVENT_TIMER].raw
        if deadline != round(DEADLINE * 1000):
            raise RobotError(
                f"node {self.node}: expected a deadline of {DEADLINE:g} s for setpoints (0x1401:05), so that the drive "
                f"stops the motor when none come; it says {deadline} ms"
            )
        drive.sdo[Object.MODE].raw = cia402.PROFILE_VELOCITY
        self._prepared = True
        self.fault, self.state = None, State.IDLE
        self._send(cia402.nmt(self.node, NmtCommand.START))
        self._nmt = Nmt.OPERATIONAL
        for _ in range(_MODE_TRIES):
            mode = drive.sdo[Object.MODE_DISPLAY].raw
            if mode == cia402.PROFILE_VELOCITY:
                return
            time.sleep(_MODE_PAUSE)
        raise RobotError(f"node {self.node}: expected profile velocity mode (0x6061), the drive stays in {mode}")

    def _map(self, pdo: canopen.pdo.PdoMap, wanted: Pdo, *, every: float = 0.0, inhibit: float | None = None) -> None:
        """Map a PDO; canopen keeps the order: switched off, its settings, no entries, each entry, how many, on."""
        pdo.cob_id = wanted.function | self.node
        pdo.enabled, pdo.trans_type, pdo.event_timer = True, 255, round(every * 1000)
        pdo.rtr_allowed = wanted.function in _COMMANDS  # the bit means nothing there
        pdo.inhibit_time = None if inhibit is None else round(inhibit * 10_000)
        pdo.clear()
        for index in wanted.objects:
            pdo.add_variable(index)
        pdo.save()

    def _words_of(self, index: int) -> str:
        try:
            return str(self._drive.sdo[index].raw)
        except canopen.SdoAbortedError:
            return ""


class _Sender:
    """What canopen takes for python-can's bus: it calls one method of it."""

    def __init__(self, send: Callable[[Frame], None]) -> None:
        self._send = send

    def send(self, message: can.Message) -> None:
        """Send now."""
        self._send(Frame(message.arbitration_id, bytes(message.data)))
