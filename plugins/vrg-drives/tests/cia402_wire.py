"""A CiA 402 axis and its emulated drive back to back, for tests, with questions of the test's own by SDO."""

import struct
from typing import NamedTuple

from vrg.hal.can.axis import MotorState
from vrg.hal.can.frame import Frame
from vrg.hal.can.protocols import PROTOCOLS
from vrg.testing.wire import SERIAL_NUMBER, ProtocolWire
from vrg_drives.cia402.axis import Cia402Axis
from vrg_drives.cia402.codec import Function
from vrg_drives.cia402.drive import Cia402Drive

NODE = 5


class Answer(NamedTuple):
    """What a node says of an object: its bytes, None where it has refused or has more to say than fits one frame."""

    object: int
    sub: int
    data: bytes | None

    @property
    def unsigned(self) -> int | None:
        """As a number."""
        return None if self.data is None else int.from_bytes(self.data, "little")


def upload_request(node: int, index: int, sub: int = 0) -> Frame:
    """Ask a node for an object."""
    return Frame(Function.SDO_REQUEST | node, struct.pack("<BHB4x", 0x40, index, sub))


def download_request(node: int, index: int, sub: int, data: bytes) -> Frame:
    """Write an object of up to 4 bytes."""
    command = 0x23 | (4 - len(data)) << 2
    return Frame(Function.SDO_REQUEST | node, struct.pack("<BHB", command, index, sub) + data.ljust(4, b"\0"))


class Wire(ProtocolWire):
    """See `ProtocolWire`."""

    axis: Cia402Axis
    drives: list[Cia402Drive]

    def __init__(self, *serials: int, node: int = NODE) -> None:
        super().__init__(PROTOCOLS.get("cia402"), node, serials or (SERIAL_NUMBER,))

    @property
    def drive(self) -> Cia402Drive:
        """The first drive."""
        return self.drives[0]

    def gets_going(self) -> None:
        """Setpoints, until the motor is under control and turns by them."""
        self.until(
            lambda: self.drive._energised and self.axis.state is MotorState.CLOSED_LOOP and 7 < self.axis.velocity < 9,
            lambda: self.axis.command(8.0),
        )

    @property
    def words(self) -> list[int]:
        """The controlwords that were sent."""
        return [int.from_bytes(f.data, "little") for f in self.sent if f.id == Function.RPDO1 | NODE]

    @property
    def setpoints(self) -> list[Frame]:
        """The setpoints that were sent."""
        return [f for f in self.sent if f.id == Function.RPDO2 | NODE]

    def ask(self, index: int, sub: int = 0) -> Answer:
        """What the drive says of an object, by SDO."""
        return self._transfer(upload_request(NODE, index, sub))

    def write(self, index: int, sub: int, value: int, size: int) -> int:
        """Write an object by SDO; the abort code, 0 for none."""
        data = (value % (1 << 8 * size)).to_bytes(size, "little")
        answer = self._transfer(download_request(NODE, index, sub, data))
        return 0 if answer.data is not None else struct.unpack_from("<I", self.heard[-1].data, 4)[0]

    def _transfer(self, request: Frame) -> Answer:
        answers = [f for f in self.drive.receive(request, self.now) if f.id == Function.SDO_ANSWER | NODE]
        assert len(answers) == 1
        self.heard += answers
        command, index, sub = struct.unpack_from("<BHB", answers[0].data)
        if command & 0xE2 == 0x42:
            size = 4 - (command >> 2 & 3) if command & 1 else 4
            return Answer(index, sub, answers[0].data[4 : 4 + size])
        return Answer(index, sub, b"" if command == 0x60 else None)
