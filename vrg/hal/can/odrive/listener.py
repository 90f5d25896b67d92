"""ODrives on a bus: how they are recognised, and what they tell."""

from vrg.errors import RobotError
from vrg.hal.can.axis import Send
from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.listener import ANSWER_PATIENCE, Claim, Found, Listener
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.endpoints import Endpoint, Endpoints
from vrg.hal.can.odrive.messages import Command
from vrg.hal.clock import Clock

_HEARTBEAT_BYTES = 8
_READ, _WRITE, _SAVE = 0, 1, 1
"""The operations of an RxSdo, and the action of a Reboot that saves first."""
_VALUES = (Command.VERSION, Command.ENCODER_ESTIMATES, Command.BUS_VOLTAGE_CURRENT)


class OdriveListener(Listener):
    """See `Listener`. A drive is recognised by its heartbeat, which some telegrams of CANopen look like.

    Attributes:
        endpoints: those of the drives' firmware; None as long as nobody has given them. Settings are named by them.
    """

    word = "odrive"
    title = "ODrive"

    def __init__(self, send: Send, clock: Clock) -> None:
        super().__init__(send, clock)
        self.endpoints: Endpoints | None = None
        self._told: dict[tuple[int, int], int] = {}

    def claim(self, frame: Frame) -> Claim:
        """A heartbeat is likely one, and so is every frame of a node that has sent one."""
        if frame.extended or frame.fd or frame.remote:
            return Claim.NONE
        if codec.node_of(frame.id) == codec.BROADCAST:
            return Claim.LIKELY if _is_nameless(frame) else Claim.NONE
        heartbeat = codec.command_of(frame.id) == Command.HEARTBEAT and len(frame.data) == _HEARTBEAT_BYTES
        return Claim.LIKELY if heartbeat or codec.node_of(frame.id) in self.found else Claim.NONE

    def hear(self, frame: Frame) -> None:
        """Take in a frame."""
        try:
            message = codec.decode(frame)
        except FrameError:
            return
        node = self._recognise(codec.node_of(frame.id), frame)
        match message:
            case messages.Heartbeat(error, state):
                node.heard = frame.at
                node.state, node.errors = messages.describe_state(state), messages.describe_errors(error)
                node.on = state not in (messages.AxisState.IDLE, messages.AxisState.UNDEFINED)
            case messages.Version():
                node.firmware = message.firmware
            case messages.Address(serial=serial):
                node.serials = tuple(sorted({*node.serials, f"{serial:X}"}))
                if node.node == codec.BROADCAST:
                    node.state, node.heard = "has no id yet", frame.at
            case messages.EncoderEstimates(position, velocity):
                node.position, node.velocity = position, velocity
            case messages.BusVoltageCurrent(voltage):
                node.voltage = voltage
            case messages.TxSdo(endpoint=endpoint, value=value):
                self._told[node.node, endpoint] = value

    def greet(self) -> None:
        """Ask every drive for its serial number."""
        self._send(codec.request(codec.BROADCAST, Command.ADDRESS))

    def stop(self) -> None:
        """Ask every axis to be idle: all at once, and each that is known by its id as well."""
        for number in (codec.BROADCAST, *self.found):
            self._send(codec.encode(number, messages.SetAxisState(messages.AxisState.IDLE)), urgent=True)

    def clear(self, node: Found) -> None:
        """Let an axis forget its errors."""
        self._send(codec.encode(node.node, messages.ClearErrors()))

    def rename(self, node: Found, serial: str, to: int) -> None:
        """Give the drive of this serial number another id, which it keeps until it is switched off, unless it is saved.

        Raises:
            RobotError: it could not be sent.
        """
        self._send(codec.encode(codec.BROADCAST, messages.Address(to, int(serial, 16))))

    def read(self, node: Found, setting: str) -> str:
        """What a drive says of an endpoint, which is named by its path.

        Raises:
            RobotError: there is no answer. ValueError: there is no such endpoint, or its firmware has other numbers.
        """
        endpoint = self._endpoint(node, setting)
        self._told.pop((node.node, endpoint.number), None)
        self._send(codec.encode(node.node, messages.RxSdo(_READ, endpoint.number)))
        if not self._clock.wait(lambda: (node.node, endpoint.number) in self._told, ANSWER_PATIENCE):
            raise RobotError(f"odrive {node.node}: expected an answer to {setting}, got none")
        return endpoint.words(self._told[node.node, endpoint.number])

    def write(self, node: Found, setting: str, value: str) -> None:
        """Change an endpoint.

        Raises:
            RobotError: it could not be sent. ValueError: as for `read`, or the value is none that it can have.
        """
        endpoint = self._endpoint(node, setting)
        self._send(codec.encode(node.node, messages.RxSdo(_WRITE, endpoint.number, endpoint.raw(value))))

    def save(self, node: Found) -> None:
        """Let a drive keep all its settings; it starts again.

        Raises:
            RobotError: it could not be sent.
        """
        self._send(codec.encode(node.node, messages.Reboot(_SAVE)))

    def _endpoint(self, node: Found, setting: str) -> Endpoint:
        if self.endpoints is None:
            raise ValueError(
                "expected --endpoints with the file flat_endpoints.json of the drive's firmware: each firmware numbers "
                "its settings anew, and a wrong number would change another one"
            )
        if node.firmware != self.endpoints.firmware:
            raise ValueError(
                f"odrive {node.node}: expected firmware {self.endpoints.firmware}, as in the file of the endpoints, "
                f"got {node.firmware or 'no answer'}"
            )
        return self.endpoints.find(setting)

    def ask(self, node: Found) -> None:
        """Ask a drive for its values, and for its serial number once it has told a version.

        Firmware 0.5, which tells none, would take the latter for an order to change its id.
        """
        if node.node == codec.BROADCAST:
            return  # it answers nothing but who it is
        for command in _VALUES:
            self._send(codec.request(node.node, command))
        if self._clock.wait(lambda: node.firmware, ANSWER_PATIENCE):
            self._send(codec.request(node.node, Command.ADDRESS))


def _is_nameless(frame: Frame) -> bool:
    """Whether a drive without an id says its serial number."""
    if codec.command_of(frame.id) != Command.ADDRESS:
        return False
    try:
        message = codec.decode(frame)
    except FrameError:
        return False
    return isinstance(message, messages.Address) and message.node == codec.BROADCAST
