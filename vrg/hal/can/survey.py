"""Who speaks on a bus, guessed from what is heard. Pure."""

from dataclasses import dataclass

from vrg.hal.can import cia402, odrive
from vrg.hal.can.cia402 import Function, Object
from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import Command

_HEARTBEAT_BYTES = 8
_CANOPEN_FUNCTIONS = frozenset(Function) - {Function.NMT, Function.HEARTBEAT}
_CANOPEN_VALUES = (
    (Object.IDENTITY, cia402.SERIAL),
    (Object.ENCODER_RESOLUTION, 1),
    (Object.ENCODER_RESOLUTION, 2),
    (Object.VELOCITY_UNIT, 0),
    (Object.STATUSWORD, 0),
    (Object.ERROR_CODE, 0),
    (Object.POSITION, 0),
    (Object.VELOCITY, 0),
    (Object.VOLTAGE, 0),
    (Object.FIRMWARE, 0),
    (Object.NAME, 0),
)
"""Texts last: they may begin a transfer in segments, which is not gone on with."""
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
        self._answers: dict[int, dict[tuple[int, int], cia402.Answer]] = {}
        self._network: dict[int, str] = {}

    @property
    def nodes(self) -> list[Found]:
        """Everybody heard so far, by protocol and id."""
        return [self._found[key] for key in sorted(self._found)]

    def hear(self, frame: Frame) -> None:
        """Take in one frame."""
        if frame.extended or frame.remote:
            return
        function, number = frame.id & ~cia402.NODE_MASK, frame.id & cia402.NODE_MASK
        if function == Function.HEARTBEAT and number and len(frame.data) == 1:
            self._hear_heartbeat(number, frame)
        elif function in _CANOPEN_FUNCTIONS and ("canopen", number) in self._found:
            # Some of these would pass for an ODrive's.
            if function == Function.SDO_ANSWER:
                self._hear_answer(number, frame.data)
        elif odrive.node_of(frame.id) in odrive.NODES:
            self._hear_odrive(frame)

    def _hear_heartbeat(self, number: int, frame: Frame) -> None:
        state = cia402.NMT_WORDS.get(frame.data[0] & 0x7F)
        if state is None:
            return
        if ("canopen", number) not in self._found:
            # What came before its first heartbeat may have been taken for the heartbeat of an ODrive.
            for _, mistaken in [key for key in self._found if key[0] == "odrive"]:
                if odrive.frame_id(mistaken, Command.HEARTBEAT) & cia402.NODE_MASK == number:
                    del self._found["odrive", mistaken]
        node = self._node("canopen", number)
        node.heard = frame.at
        self._network[number] = state
        self._tell(node)

    def _hear_answer(self, number: int, data: bytes) -> None:
        """Of an SDO; a text that needs more than one frame is left alone."""
        answer = cia402.answer(data)
        if answer is None or answer.data is None:
            return
        node = self._node("canopen", number)
        self._answers.setdefault(number, {})[answer.object, answer.sub] = answer
        if (answer.object, answer.sub) == (Object.IDENTITY, cia402.SERIAL):
            node.serials = tuple(sorted({*node.serials, f"{answer.unsigned:X}"}))
        elif answer.object in (Object.FIRMWARE, Object.NAME) and not node.firmware:
            node.firmware = answer.data.decode("ascii", "replace").strip("\0 ")
        self._tell(node)

    def _tell(self, node: Found) -> None:
        """Put what a CANopen node has answered into words and units."""
        answers = self._answers.get(node.node, {})

        def number(index: int, sub: int = 0, *, signed: bool = False) -> int | None:
            answer = answers.get((index, sub))
            return None if answer is None else answer.signed if signed else answer.unsigned

        node.state = self._network[node.node]
        status, error, millivolts = number(Object.STATUSWORD), number(Object.ERROR_CODE), number(Object.VOLTAGE)
        if status is not None:
            state = cia402.drive_state(status)
            node.state += f", {state.words if state else f'statusword 0x{status:04X}'}"
        node.errors = cia402.describe_error(error or 0)
        node.voltage = None if millivolts is None else millivolts / 1000
        counts, turns = (number(Object.ENCODER_RESOLUTION, sub) or 0 for sub in (1, 2))
        units = cia402.units(counts, turns, number(Object.VELOCITY_UNIT))
        position, velocity = number(Object.POSITION, signed=True), number(Object.VELOCITY, signed=True)
        if units is not None:
            node.position = None if position is None else units.turns(position)
            node.velocity = None if velocity is None else units.turns_per_s(velocity)

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
    return [cia402.upload_request(found.node, index, sub) for index, sub in _CANOPEN_VALUES]
