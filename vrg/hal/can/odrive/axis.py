"""One axis of an ODrive, by CANSimple."""

from pydantic import Field, model_validator

from vrg.hal.can.axis import NEVER, Axis, MotorState, ProtocolOptions, Send
from vrg.hal.can.frame import Filter, Frame, FrameError
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.messages import AxisError, Command, describe_result
from vrg.hal.clock import MonotonicClock


class OdriveOptions(ProtocolOptions):
    """The options of an ODrive. Without them its own limits stay as they were saved in it.

    Args:
        velocity_limit: the highest speed of the motor, turn/s. current_limit: its highest current, A. Both are given,
            or none: one message sets both, each time that the robot connects.
    """

    velocity_limit: float | None = Field(None, gt=0, le=10_000)
    current_limit: float | None = Field(None, gt=0, le=1_000)

    @model_validator(mode="after")
    def _both(self) -> "OdriveOptions":
        if (self.velocity_limit is None) != (self.current_limit is None):
            raise ValueError("expected velocity_limit and current_limit, or neither: one message sets both")
        return self


_NODE_MASK = 0x7E0
"""The bits of an identifier that all commands of one node have in common."""
_TOLD = (Command.ERROR, Command.IQ, Command.TEMPERATURE, Command.TORQUES, Command.POWERS)
"""The messages of a drive that this axis does not use."""
_SUPPLY_PERIOD = 1.5
"""s without the supply's voltage after which it is asked for."""
_UNCOMMANDED = 0.1
"""s without a setpoint from which on the watchdog may expire at any time."""
_NMT_BYTES = 2
"""The size of a network command of CANopen, which has the identifier of the version of node 0."""
_VERSION_REQUESTS = 6
"""The number of requests for its version, one each 0.5 s, after which the lack of an answer is a problem."""
_REZERO = float(1 << 18)
"""turns beyond which a float32 steps by more than 1/64 turn; the position is then set back to zero before a start."""


class OdriveAxis(Axis):
    """See `Axis`. All that can be wrong with the drive is in its heartbeat."""

    encoder_advice = "set axis0.config.can.encoder_msg_rate_ms to 10 in the drive"
    options: OdriveOptions
    options_type = OdriveOptions

    def __init__(self, node: int, send: Send, clock: MonotonicClock, options: ProtocolOptions | None = None) -> None:
        super().__init__(node, send, clock, options)
        self._version: messages.Version | None = None
        self._heartbeat = messages.Heartbeat(0, messages.AxisState.UNDEFINED)
        self._wanted = False
        self._asked_supply = self._commanded = NEVER
        self._asked = 0

    @classmethod
    def check_node(cls, node: int) -> str | None:
        """A drive has an id from 0 to 62; 63 means everybody."""
        return None if node in codec.NODE_IDS else f"expected 0 to {codec.NODE_IDS[-1]}, got {node}"

    @classmethod
    def check_output(cls, bit: int) -> str | None:
        """CANSimple 0.6 has no message for outputs; the endpoints that RxSdo (0x04) writes change with the firmware."""
        return (
            f"expected none, got {bit}: CANSimple has no message for the GPIOs of an ODrive. Wire the actuator to a "
            "drive that has digital outputs, such as one of CiA 402, or write a driver of your own"
        )

    @property
    def filters(self) -> list[Filter]:
        """They let all frames from and to this node and to all nodes through, so that another master is noticed."""
        return [Filter(self.node << 5, _NODE_MASK), Filter(codec.BROADCAST << 5, _NODE_MASK)]

    @property
    def words(self) -> str:
        """The state of the axis, as ODrive writes it."""
        return messages.describe_state(self._heartbeat.state)

    @property
    def errors(self) -> str:
        """All error bits, as ODrive writes them."""
        return messages.describe_errors(self._heartbeat.error)

    @property
    def identified(self) -> bool:
        """True if the version has been received; serial numbers follow at once, if the firmware has them."""
        return self._version is not None or self.problem is not None

    @property
    def problem(self) -> str | None:
        """Firmware 0.5, which reports no version; a protocol that is not CANSimple 2; or two drives with this id."""
        if self._version is None and self._asked > _VERSION_REQUESTS and self.heard != NEVER:
            return "it reports no version: expected firmware 0.6 or newer, as 0.5 and older speak another CANSimple"
        if self.shared:
            return self.shared
        version = self._version
        if version is not None and version.protocol != messages.PROTOCOL_VERSION:
            return f"expected CANSimple protocol version {messages.PROTOCOL_VERSION}, got {version.protocol}"
        return None

    def forget(self) -> None:
        """Let the drive say again who and what it is."""
        super().forget()
        self._version, self._asked = None, 0

    def receive(self, frame: Frame) -> None:
        """Hear a frame."""
        foreign = frame.extended or frame.fd or frame.remote or (frame.id == 0 and len(frame.data) == _NMT_BYTES)
        if foreign or codec.node_of(frame.id) not in (self.node, codec.BROADCAST):
            return
        try:
            message = codec.decode(frame)
        except FrameError as error:
            self._complain(f"a malformed frame: {error}")
            return
        match message:
            case messages.Heartbeat():
                self._judge(message, frame.at)
            case messages.EncoderEstimates():
                self._estimate(message.position, message.velocity, frame.at)
            case messages.BusVoltageCurrent():
                self._supply(message.voltage, frame.at)
            case messages.Version():
                self._learn(message)
            case messages.Address(node=node) if codec.node_of(frame.id) == codec.BROADCAST:
                if node != codec.BROADCAST:  # that would be a drive without an id, which reports its serial number
                    self._complain("another program gives drives other ids")
            case messages.Address(node=node, serial=serial):
                if node == self.node:
                    self.serials.add(f"{serial:X}")
            case messages.Estop():
                # A button at the drive: it is off from this moment, before its heartbeat shows it.
                self.state = MotorState.ESTOP
                self._wanted = False
            case _ if not _asks_or_tells(message):
                # Everything else is an order, and only this axis may give its drive one.
                name = message.title if isinstance(message, messages.Other) else type(message).__name__
                self._complain(f"another program commands it too: {name}")

    def identify(self, patience: float) -> None:
        """Ask for the version; the answer comes to `receive`, which then asks for the serial number."""
        self._asked += 1
        self._send(codec.request(self.node, Command.VERSION))

    def ask_serial(self) -> None:
        """Ask for the address, which has the serial number."""
        self._send(codec.request(self.node, Command.ADDRESS))

    def prepare(self) -> None:
        """Set the limits that a person has given."""
        self._limit()

    def start(self) -> None:
        """Ask for closed-loop velocity control."""
        if abs(self.position) > _REZERO:
            self._send(codec.encode(self.node, messages.SetAbsolutePosition(0.0)))
        self._limit()  # it does not tell that it was started again meanwhile
        self._order_start()
        self._wanted, self.expiry_reported, self.refusal = True, False, None
        if self.state is MotorState.IDLE:
            self.state = MotorState.STARTING
        # Its next heartbeat may be 0.1 s away.
        self._send(codec.request(self.node, Command.HEARTBEAT))

    def _limit(self) -> None:
        velocity, current = self.options.velocity_limit, self.options.current_limit
        if velocity is not None and current is not None:
            self._send(codec.encode(self.node, messages.SetLimits(velocity, current)))

    def command(self, velocity: float) -> None:
        """Send a setpoint in turn/s; before it, as long as the axis starts, the order to start, which may get lost."""
        if self._wanted and self.state is MotorState.STARTING:
            self._order_start()
        self._commanded = self._clock.now()
        self._send(codec.encode(self.node, messages.SetInputVel(velocity)))

    def _order_start(self) -> None:
        mode = messages.SetControllerMode(messages.VELOCITY_CONTROL, messages.PASSTHROUGH)
        self._send(codec.encode(self.node, mode))
        self._send(codec.encode(self.node, messages.SetInputVel(0.0)))
        self._send(codec.encode(self.node, messages.SetAxisState(messages.AxisState.CLOSED_LOOP_CONTROL)))

    def idle(self) -> None:
        """Switch the motor off."""
        self._wanted = False
        self._send(codec.encode(self.node, messages.SetAxisState(messages.AxisState.IDLE)), urgent=True)
        if self.state in (MotorState.STARTING, MotorState.CLOSED_LOOP):
            self.state = MotorState.IDLE

    def stop_now(self) -> None:
        """Send the Estop frame."""
        self._wanted = False
        self._send(codec.encode(self.node, messages.Estop()), urgent=True)

    def clear(self) -> None:
        """Forget latched errors."""
        self._send(codec.encode(self.node, messages.ClearErrors()))
        self._send(codec.request(self.node, Command.HEARTBEAT))

    def poll(self, now: float) -> None:
        """Ask for what the drive does not send: the supply's voltage, whose period is 0 by default, and its state.

        Its heartbeats are 0.1 s apart, which is too coarse to measure its watchdog by.
        """
        if self.state is MotorState.CLOSED_LOOP and now - self._commanded > _UNCOMMANDED:
            self._send(codec.request(self.node, Command.HEARTBEAT))
        if now - max(self.supplied, self._asked_supply) > _SUPPLY_PERIOD:
            self._asked_supply = now
            self._send(codec.request(self.node, Command.BUS_VOLTAGE_CURRENT))

    def _learn(self, version: messages.Version) -> None:
        """Take in the version, and ask for the serial number.

        Firmware 0.5, which tells no version, would take that question for an order to change its id.
        """
        self._version, self.firmware = version, version.firmware
        if version.protocol == messages.PROTOCOL_VERSION and not self.serials:
            self.ask_serial()

    def _judge(self, heartbeat: messages.Heartbeat, at: float) -> None:
        self._heartbeat, self.heard = heartbeat, at
        self._report_on(heartbeat.state not in (messages.AxisState.IDLE, messages.AxisState.UNDEFINED), at)
        errors = heartbeat.error
        self.watchdog_expired = bool(errors & AxisError.WATCHDOG_TIMER_EXPIRED)
        self.expiry_reported |= self.watchdog_expired
        if self._wanted and heartbeat.state == messages.AxisState.IDLE and heartbeat.result:
            self.refusal = describe_result(heartbeat.result)
        serious = errors & ~(AxisError.WATCHDOG_TIMER_EXPIRED | AxisError.ESTOP_REQUESTED)
        self.fault = messages.describe_errors(serious) or None if serious else None
        if errors & AxisError.ESTOP_REQUESTED:
            self.state = MotorState.ESTOP
        elif serious:
            self.state = MotorState.FAULT
        elif heartbeat.state == messages.AxisState.CLOSED_LOOP_CONTROL:
            self.state = MotorState.CLOSED_LOOP
        elif heartbeat.state == messages.AxisState.IDLE:
            # Until its first heartbeat in closed loop an axis that was ordered to start still reports that it idles.
            starting = self._wanted and not self.watchdog_expired and self.state is MotorState.STARTING
            self.state = MotorState.STARTING if starting else MotorState.IDLE
        else:
            self.state = MotorState.FAULT
            self.fault = f"expected IDLE or CLOSED_LOOP_CONTROL, it is in {messages.describe_state(heartbeat.state)}"


def _asks_or_tells(message: messages.Message) -> bool:
    """True if a message only asks a drive for a value, or reports one."""
    match message:
        case messages.Other(command):
            return command in _TOLD
        case messages.RxSdo(opcode):
            return opcode == 0
        case _:
            return isinstance(message, messages.TxSdo)
