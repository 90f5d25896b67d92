"""How a drive is asked for its objects: canopen's SDO client, on frames that somebody else receives."""

import contextlib
import logging
import queue
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import can
import canopen

from vrg.errors import RobotError
from vrg.hal.can.cia402.dictionary import object_dictionary
from vrg.hal.can.cia402.network import Function
from vrg.hal.can.cia402.objects import SERIAL, Object
from vrg.hal.can.frame import Frame
from vrg.hal.clock import Clock

# canopen logs the errors that it raises as well.
logging.getLogger("canopen").setLevel(logging.CRITICAL)

_SERIAL_ANSWER = struct.pack("<BHB", 0x43, Object.IDENTITY, SERIAL)
"""The first four bytes of the answer to the question for the serial number; the number itself follows."""
_BEGINS = (0x20, 0x40)
"""What the first byte of a request begins with that names an object: a download and an upload."""


class NoAnswerError(RobotError):
    """A drive has not answered, or its answer makes no sense."""


class SdoClient:
    """The SDO client of one drive. Whoever receives frames calls `hear` with its SDO answers, on another thread.

    canopen takes the first answer to a question for the only one. A second drive that has the same id by mistake gives
    another one, so the answers that tell a serial number are counted here as well.

    Args:
        node: the drive's id. send: sends a frame. clock: the time by which its answers are waited for.

    Attributes:
        remote: the drive as canopen has it. Use it only within `transfer`.
        serials: all serial numbers that were heard. serial_answers: how many answers told one.
        asking: a transfer is under way.
    """

    def __init__(self, node: int, send: Callable[[Frame], None], clock: Clock) -> None:
        self.serials: set[int] = set()
        self.serial_answers = 0
        self.asking = False
        self._answer = Function.SDO_ANSWER | node
        self._network = canopen.Network()
        self._sender = _Sender(send)
        self._network.bus = self._sender  # type: ignore[assignment]
        self.remote = canopen.RemoteNode(node, object_dictionary(node))
        self._network.add_node(self.remote)
        self._timeout = 0.0
        _wait_by(clock, self.remote, lambda: self._timeout)

    @property
    def asked(self) -> tuple[int, int]:
        """The object of the newest transfer."""
        return self._sender.asked

    def hear(self, data: bytes) -> None:
        """Take in the data of an SDO answer of the drive."""
        if data.startswith(_SERIAL_ANSWER) and len(data) == 8:
            self.serials.add(int.from_bytes(data[4:], "little"))
            self.serial_answers += 1
        # Answers to the questions of another master are not kept: nobody would ever take them.
        if self.asking:
            self._network.notify(self._answer, bytearray(data), 0.0)

    @contextmanager
    def transfer(self, timeout: float) -> Iterator[None]:
        """Let canopen ask within this block.

        Args:
            timeout: s to wait for each answer.

        Raises:
            NoAnswerError: the drive has not answered, or its answer makes no sense.
            canopen.SdoAbortedError: it has refused.
            RobotError: a question could not be sent.
        """
        self._timeout = max(1e-3, timeout)
        self.asking = True
        try:
            yield
        except (canopen.SdoCommunicationError, canopen.ObjectDictionaryError, struct.error) as error:
            raise NoAnswerError(str(error)) from None
        finally:
            self.asking = False

    def read(self, index: int, sub: int, timeout: float) -> bytes | None:
        """The value of an object, or None where the drive refuses to tell it: it may have no such object.

        Raises:
            NoAnswerError: the drive has not answered within `timeout` s, or its answer makes no sense.
            RobotError: the question could not be sent.
        """
        with self.transfer(timeout):
            try:
                return bytes(self.remote.sdo.upload(index, sub))
            except canopen.SdoAbortedError:
                return None

    def write(self, index: int, sub: int, data: bytes, timeout: float) -> bool:
        """Write an object; False where the drive refuses.

        Raises:
            NoAnswerError: the drive has not answered within `timeout` s, or its answer makes no sense.
            RobotError: the request could not be sent.
        """
        with self.transfer(timeout):
            try:
                self.remote.sdo.download(index, sub, data)
            except canopen.SdoAbortedError:
                return False
            return True


def _wait_by(clock: Clock, remote: canopen.RemoteNode, timeout: Callable[[], float]) -> None:
    """Let canopen's client wait for answers by a clock; by itself it waits in real time."""
    sdo = remote.sdo
    read_response = sdo.read_response
    sdo.RESPONSE_TIMEOUT = 0.0

    def wait_and_read() -> bytes:
        with contextlib.suppress(queue.Empty):
            sdo.responses.put(clock.take(sdo.responses, timeout()))
        return bytes(read_response())

    sdo.read_response = wait_and_read


class _Sender:
    """What canopen takes for python-can's bus: it calls one method of it."""

    def __init__(self, send: Callable[[Frame], None]) -> None:
        self._send = send
        self.asked = (0, 0)

    def send(self, message: can.Message) -> None:
        """Send now."""
        if message.data[0] & 0xE0 in _BEGINS:
            self.asked = (int.from_bytes(message.data[1:3], "little"), message.data[3])
        self._send(Frame(message.arbitration_id, bytes(message.data)))
