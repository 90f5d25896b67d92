"""Own frames that a bus gives back to who has sent them: they must not be taken for another master's."""

from collections import Counter, deque

from vrg.hal.can.frame import Frame

_MEMORY = 1.0
"""s after which a frame is no longer expected to come back: one that never does must not hide a stranger's."""

_Key = tuple[int, bytes, bool, bool]


class Echoes:
    """Remembers what was sent until it has come back. Times are monotonic, s."""

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

    def returns(self, frame: Frame, now: float) -> bool:
        """Whether a frame that was received is one of our own. Each comes back once."""
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
