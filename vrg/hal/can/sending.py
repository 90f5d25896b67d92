"""Paces frames so that they do not fill the transmit queue of an interface: numbers alone.

Linux gives a CAN interface a queue of ten frames, and it should be no longer: what waits there is old when it goes out.
A program that sends more at once gets an error. So ordinary frames leave room in the queue for those that switch motors
off, which never wait here.
"""

from collections import Counter, deque

from vrg.hal.can.frame import Frame

MAX_IN_FLIGHT = 6
"""Ordinary frames that may be under way at once. Four places are left for frames that stop the motors of a robot."""
FRAME_BITS = 150
"""Bits of a frame at most, and some to spare: 135 with the worst stuffing and the space between two (ISO 11898-1)."""
ASSUMED_BIT_RATE = 250_000
"""bit/s of a bus whose bit rate is not known. Slower ones are rare, and on a faster one little is lost."""


class TokenBucket:
    """A bucket of MAX_IN_FLIGHT tokens, one for each frame. A token comes back once its frame is through.

    Times are monotonic, s.

    Args:
        frame_time: s that a frame takes; 0 on a bus that has no bit rate, where nothing ever waits.
    """

    def __init__(self, frame_time: float) -> None:
        self.frame_time = frame_time
        self._busy_until = 0.0

    def delay(self, now: float) -> float:
        """s to wait before an ordinary frame may be sent."""
        return max(0.0, self._busy_until - now - (MAX_IN_FLIGHT - 1) * self.frame_time)

    def sent(self, now: float) -> None:
        """A frame, of whatever kind, has been sent."""
        self._busy_until = max(self._busy_until, now) + self.frame_time


_MEMORY = 1.0
"""s after which a frame is no longer expected to come back: one that never does must not hide a stranger's."""

_Key = tuple[int, bytes, bool, bool]


class Echoes:
    """Remembers what was sent until it has returned. Times are monotonic, s."""

    def __init__(self) -> None:
        self._expected: Counter[_Key] = Counter()
        self._recent: Counter[_Key] = Counter()
        self._sent: deque[tuple[float, _Key]] = deque()

    def sent(self, frame: Frame, now: float) -> None:
        """A frame has been sent."""
        self._forget(now)
        key = _key(frame)
        self._expected[key] += 1
        self._recent[key] += 1
        self._sent.append((now, key))

    def unsent(self, frame: Frame) -> None:
        """A frame could not be sent after all, and will not come back."""
        self._expected[_key(frame)] -= 1

    def returns(self, frame: Frame, now: float) -> bool:
        """True if a received frame is one that this process has sent. Each comes back once."""
        self._forget(now)
        key = _key(frame)
        if not self._expected[key]:
            return False
        self._expected[key] -= 1
        return True

    def _forget(self, now: float) -> None:
        while self._sent and now - self._sent[0][0] > _MEMORY:
            _, key = self._sent.popleft()
            self._recent[key] -= 1
            self._expected[key] = min(self._expected[key], self._recent[key])
            if not self._recent[key]:
                del self._recent[key], self._expected[key]


def _key(frame: Frame) -> _Key:
    return frame.id, frame.data, frame.remote, frame.extended
