"""Who speaks on a bus, guessed from what is heard. Pure."""

from dataclasses import dataclass

from vrg.hal.can import odrive
from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import Command

_CANOPEN_HEARTBEAT = 0x700
_CANOPEN_STATES = {0: "booting", 4: "stopped", 5: "operational", 127: "pre-operational"}
_HEARTBEAT_BYTES = 8
_ODRIVE_VALUES = (Command.VERSION, Command.ADDRESS, Command.ENCODER_ESTIMATES, Command.BUS_VOLTAGE_CURRENT)


@dataclass
class Found:
    """One node.

    Args:
        protocol: `odrive` or `canopen`. state: in words. heard: monotonic s of its newest heartbeat.
        serials: serial numbers that answered for this node, in words: two drives may share an id by mistake.
        firmware: in words, empty before it is known. errors: in words, empty for none.
    """

    protocol: str
    node: int
    state: str = ""
    errors: str = ""
    firmware: str = ""
    heard: float = 0.0
    serials: tuple[str, ...] = ()
    position: float | None = None
    velocity: float | None = None
    voltage: float | None = None


class Survey:
    """Listens to a bus."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, int], Found] = {}

    @property
    def nodes(self) -> list[Found]:
        """Everybody heard so far, by protocol and id."""
        return [self._found[key] for key in sorted(self._found)]

    def hear(self, frame: Frame) -> None:
        """Take in one frame."""
        if frame.extended or frame.remote:
            return
        if frame.id & ~0x7F == _CANOPEN_HEARTBEAT and frame.id & 0x7F and len(frame.data) == 1:
            state = _CANOPEN_STATES.get(frame.data[0] & 0x7F)
            if state is not None:
                node = self._node("canopen", frame.id & 0x7F)
                node.state, node.heard = state, frame.at
        elif odrive.node_of(frame.id) in odrive.NODES:
            self._hear_odrive(frame)

    def _hear_odrive(self, frame: Frame) -> None:
        number = odrive.node_of(frame.id)
        command = odrive.command_of(frame.id)
        known = ("odrive", number) in self._found
        heartbeat = command == odrive.Command.HEARTBEAT and len(frame.data) == _HEARTBEAT_BYTES
        if not (known or heartbeat):
            return
        try:
            message = odrive.decode(frame)
        except FrameError:
            return
        node = self._node("odrive", number)
        match message:
            case odrive.Heartbeat(error, state):
                node.heard = frame.at
                node.state, node.errors = odrive.describe_state(state), odrive.describe_errors(error)
            case odrive.Version():
                node.firmware = message.firmware
            case odrive.Address(serial=serial):
                node.serials = tuple(sorted({*node.serials, f"{serial:X}"}))
            case odrive.EncoderEstimates(position, velocity):
                node.position, node.velocity = position, velocity
            case odrive.BusVoltageCurrent(voltage):
                node.voltage = voltage

    def _node(self, protocol: str, node: int) -> Found:
        return self._found.setdefault((protocol, node), Found(protocol, node))

    def __str__(self) -> str:
        """Who is there, in one line."""
        words = []
        for protocol, name in (("odrive", "ODrive"), ("canopen", "CANopen")):
            nodes = [str(found.node) for found in self.nodes if found.protocol == protocol]
            if nodes:
                words.append(f"{name} node{'s' if len(nodes) > 1 else ''} {', '.join(nodes)}")
        return " and ".join(words) or "nobody"


def questions(found: Found | None) -> list[Frame]:
    """What to ask a node to know all of it; None asks everybody who they are."""
    if found is None:
        return [odrive.request(odrive.BROADCAST, Command.ADDRESS)]
    if found.protocol == "odrive":
        return [odrive.request(found.node, command) for command in _ODRIVE_VALUES]
    return []
