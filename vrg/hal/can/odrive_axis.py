"""One axis of an ODrive, by CANSimple."""

from collections.abc import Callable

from vrg.hal.can import odrive
from vrg.hal.can.axis import Axis, State
from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import AxisError, Command

_NODE_MASK = 0x7E0
"""Of an identifier: all commands of one node."""
_MASTER_COMMANDS = frozenset(
    {
        Command.SET_CONTROLLER_MODE, Command.SET_INPUT_POS, Command.SET_INPUT_VEL,
        Command.SET_INPUT_TORQUE, Command.SET_ABSOLUTE_POSITION,
    }
)  # fmt: skip
"""Nobody but this axis' master may send these to its drive."""
_REZERO = float(1 << 18)
"""turn; beyond it a float32 steps by more than 1/64 turn, so the position is set back to zero before a start."""


class OdriveAxis(Axis):
    """See `Axis`. All that can be wrong with the drive is in its heartbeat."""

    protocol = "odrive"

    def __init__(self, node: int, send: Callable[[Frame], None]) -> None:
        super().__init__(node, send)
        self._version: odrive.Version | None = None
        self._serials: set[int] = set()
        self._wanted = False

    @classmethod
    def check_node(cls, node: int) -> str | None:
        """0 to 62; 63 means everybody."""
        return None if node in odrive.NODES else f"expected 0 to {odrive.NODES[-1]}, got {node}"

    @property
    def filters(self) -> list[tuple[int, int]]:
        """All frames from and to this node, so that another master is noticed."""
        return [(self.node << 5, _NODE_MASK)]

    @property
    def identified(self) -> bool:
        """The version has come; serial numbers follow within the same moment, if the firmware has them."""
        return self._version is not None

    @property
    def problem(self) -> str | None:
        """A protocol that is not CANSimple 2, or two drives with this id."""
        if len(self._serials) > 1:
            both = " and ".join(f"{serial:X}" for serial in sorted(self._serials))
            return f"{len(self._serials)} drives have this id: serial numbers {both}; give one another id"
        version = self._version
        if version is not None and version.protocol != odrive.PROTOCOL_VERSION:
            return f"expected CANSimple protocol version {odrive.PROTOCOL_VERSION}, got {version.protocol}"
        return None

    def receive(self, frame: Frame) -> None:
        """Hear a frame."""
        if frame.extended or odrive.node_of(frame.id) != self.node or frame.remote:
            return
        command = odrive.command_of(frame.id)
        try:
            message = odrive.decode(frame)
        except FrameError as error:
            self._complain(f"a malformed frame: {error}")
            return
        match message:
            case odrive.Heartbeat():
                self._heartbeat(message, frame.at)
            case odrive.EncoderEstimates():
                self._estimate(message.position, message.velocity, frame.at)
            case odrive.BusVoltageCurrent():
                self.voltage = message.voltage
            case odrive.Version():
                self._version, self.firmware = message, message.firmware
            case odrive.Address(node=node, serial=serial) if node == self.node:
                self._serials.add(serial)
                self.serial = f"{serial:X}"
            case odrive.Estop():
                # Somebody else's button: the drive is off from this moment, before its heartbeat says so.
                self.state = State.ESTOP
                self._wanted = False
            case _ if command in _MASTER_COMMANDS:
                self._complain("another program commands it too")

    def identify(self) -> None:
        """Ask for version and serial number."""
        self._send(odrive.request(self.node, Command.VERSION))
        self._send(odrive.request(odrive.BROADCAST, Command.ADDRESS))
        self._send(odrive.request(self.node, Command.ADDRESS))

    def prepare(self) -> None:
        """Nothing: each start sends the mode with it."""

    def start(self) -> None:
        """Ask for closed-loop velocity control."""
        if abs(self.position) > _REZERO:
            self._send(odrive.encode(self.node, odrive.SetAbsolutePosition(0.0)))
        mode = odrive.SetControllerMode(odrive.ControlMode.VELOCITY, odrive.PASSTHROUGH)
        self._send(odrive.encode(self.node, mode))
        self._send(odrive.encode(self.node, odrive.SetInputVel(0.0)))
        self._send(odrive.encode(self.node, odrive.SetAxisState(odrive.AxisState.CLOSED_LOOP_CONTROL)))
        self._wanted = True
        if self.state is State.IDLE:
            self.state = State.STARTING
        # Its next heartbeat may be 0.1 s away.
        self._send(odrive.request(self.node, Command.HEARTBEAT))

    def command(self, velocity: float) -> None:
        """Send a setpoint, turn/s."""
        self._send(odrive.encode(self.node, odrive.SetInputVel(velocity)))

    def idle(self) -> None:
        """Switch the motor off."""
        self._wanted = False
        self._send(odrive.encode(self.node, odrive.SetAxisState(odrive.AxisState.IDLE)))
        if self.state in (State.STARTING, State.CLOSED_LOOP):
            self.state = State.IDLE

    def stop_now(self) -> None:
        """The Estop frame."""
        self._wanted = False
        self._send(odrive.encode(self.node, odrive.Estop()))

    def clear(self) -> None:
        """Forget latched errors."""
        self._send(odrive.encode(self.node, odrive.ClearErrors()))
        self._send(odrive.request(self.node, Command.HEARTBEAT))

    def _heartbeat(self, heartbeat: odrive.Heartbeat, at: float) -> None:
        self.heard = at
        errors = heartbeat.error
        self.starved = bool(errors & AxisError.WATCHDOG_TIMER_EXPIRED)
        serious = errors & ~(AxisError.WATCHDOG_TIMER_EXPIRED | AxisError.ESTOP_REQUESTED)
        self.fault = odrive.describe_errors(serious) or None
        if errors & AxisError.ESTOP_REQUESTED:
            self.state = State.ESTOP
        elif serious:
            self.state = State.FAULT
        elif heartbeat.state == odrive.AxisState.CLOSED_LOOP_CONTROL:
            self.state = State.CLOSED_LOOP
        elif heartbeat.state == odrive.AxisState.IDLE:
            # Until its first heartbeat in closed loop an axis that was asked to start still says that it idles.
            starting = self._wanted and not self.starved and self.state is State.STARTING
            self.state = State.STARTING if starting else State.IDLE
        else:
            self.state = State.FAULT
            self.fault = f"expected IDLE or CLOSED_LOOP_CONTROL, it is in {odrive.describe_state(heartbeat.state)}"
