"""Reads and writes the objects of a drive: canopen's SDO client, on frames that another object receives."""

import logging
import queue
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import canopen
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.client import SdoClient as CanopenClient

from vrg.errors import RobotError
from vrg.hal.can.frame import Frame
from vrg.hal.clock import MonotonicClock
from vrg_drives.cia402.codec import SERIAL_NUMBER, Function, Object

# canopen logs the errors that it raises as well.
logging.getLogger("canopen").setLevel(logging.CRITICAL)

_SERIAL_ANSWER = struct.pack("<BHB", 0x43, Object.IDENTITY, SERIAL_NUMBER)
"""The first four bytes of the answer to the question for the serial number; the number itself follows."""
_BEGINS = {0x20: 0x60, 0x40: 0x40}
"""The kinds of requests that name an object, a download and an upload, with the kind of answer that begins each."""
_SEGMENTS = {0x00: 0x20, 0x60: 0x00}
"""The kinds of requests for one segment of an object, which name none, with the kind of its answer."""
_KIND, _ABORT = 0xE0, 0x80
"""The bits of the first byte that tell the kind of a request or an answer; the kind of a refusal."""


class NoAnswerError(RobotError):
    """A drive has not answered, or its answer makes no sense."""


class SdoClient(CanopenClient):
    """The SDO client of one drive. The receiver of frames calls `hear` with its SDO answers, on another thread.

    It needs no dictionary of objects, and waits by a clock; canopen's own waits in real time.

    canopen takes the first answer to a question for the only one. A second drive that has the same id by mistake gives
    another one, so the answers that tell a serial number are counted here as well.

    Args:
        node: the drive's id. send: sends a frame. clock: the time by which its answers are waited for.

    Attributes:
        serials: all serial numbers that were received. serial_answers: the number of answers with one.
        asking: a transfer is under way. asked: the object of the newest one.
    """

    RESPONSE_TIMEOUT = 0.0

    def __init__(self, node: int, send: Callable[[Frame], None], clock: MonotonicClock) -> None:
        super().__init__(Function.SDO_REQUEST | node, Function.SDO_ANSWER | node, ObjectDictionary())  # type: ignore[no-untyped-call]
        self.serials: set[int] = set()
        self.serial_answers = 0
        self.asking = False
        self.asked = (0, 0)
        self._send, self._clock = send, clock
        self._timeout = 0.0
        self._kind = 0

    def hear(self, data: bytes) -> None:
        """Take in the data of an SDO answer of the drive."""
        if data.startswith(_SERIAL_ANSWER) and len(data) == 8:
            self.serials.add(int.from_bytes(data[4:], "little"))
            self.serial_answers += 1
        # Answers to the questions of another master are not kept: they would never be taken.
        if self.asking:
            self.responses.put(data)

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
        except (canopen.SdoCommunicationError, struct.error) as error:
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
                return bytes(self.upload(index, sub))
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
                self.download(index, sub, data)
            except canopen.SdoAbortedError:
                return False
            return True

    def send_request(self, request: bytes) -> None:
        """Send now; canopen calls this."""
        self._kind = request[0] & _KIND
        if self._kind in _BEGINS:
            self.asked = (int.from_bytes(request[1:3], "little"), request[3])
        self._send(Frame(self.rx_cobid, bytes(request)))

    def read_response(self) -> bytes:
        """Wait for an answer to the newest request; canopen calls this, and takes whatever comes first.

        An answer that comes twice or late would otherwise be taken for that to the next question.
        """
        deadline = self._clock.now() + self._timeout
        answer = b""
        while not self._fits(answer):
            try:
                answer = self._clock.take(self.responses, max(0.0, deadline - self._clock.now()))
            except queue.Empty:
                raise canopen.SdoCommunicationError("no answer") from None
        self.responses.put(answer)
        return bytes(super().read_response())  # type: ignore[no-untyped-call]

    def _fits(self, answer: bytes) -> bool:
        """True if an answer is one to the newest request, or refuses it."""
        if not answer:
            return False
        kind = answer[0] & _KIND
        if kind == _SEGMENTS.get(self._kind):
            return True
        return kind in (_BEGINS.get(self._kind), _ABORT) and answer[1:4] == struct.pack("<HB", *self.asked)
