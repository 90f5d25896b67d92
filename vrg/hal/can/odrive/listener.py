"""ODrives on a bus: how they are recognised, and what they tell."""

from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.listener import Claim, Found, Listener
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.messages import Command

_HEARTBEAT_BYTES = 8
_VALUES = (Command.VERSION, Command.ADDRESS, Command.ENCODER_ESTIMATES, Command.BUS_VOLTAGE_CURRENT)


class OdriveListener(Listener):
    """See `Listener`. A drive is recognised by its heartbeat, which some telegrams of CANopen look like."""

    word = "odrive"
    title = "ODrive"

    def claim(self, frame: Frame) -> Claim:
        """A heartbeat is likely one, and so is every frame of a node that has sent one."""
        if frame.extended or frame.remote or codec.node_of(frame.id) not in codec.NODES:
            return Claim.NONE
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
            case messages.Version():
                node.firmware = message.firmware
            case messages.Address(serial=serial):
                node.serials = tuple(sorted({*node.serials, f"{serial:X}"}))
            case messages.EncoderEstimates(position, velocity):
                node.position, node.velocity = position, velocity
            case messages.BusVoltageCurrent(voltage):
                node.voltage = voltage

    def greet(self) -> None:
        """Ask every drive for its serial number."""
        self._send(codec.request(codec.BROADCAST, Command.ADDRESS))

    def ask(self, node: Found) -> None:
        """Ask a drive for its values; the answers come to `hear`, so that this waits for nothing."""
        for command in _VALUES:
            self._send(codec.request(node.node, command))
