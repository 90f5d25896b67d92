"""Finds the processes that hang, by comparing them. This module uses no bus and reads no clock.

A process that gives no sign of life hangs. But if no process gives any, the whole machine has stalled, and none of them
is at fault. So silence is not measured in real time: the time that counts goes on only while some process is heard.
"""

from collections.abc import Iterable

HUNG = 2.5
"""The time in s without a pulse, while others are heard, after which a process is taken to hang. Pulses come every
0.5 s."""
MAX_PAUSE = 1.0
"""The longest time in s that counts for a pause in which no process was heard."""


class Pulses:
    """The signs of life of several processes.

    Args:
        now: the monotonic time, s; so in all methods.
    """

    def __init__(self, now: float) -> None:
        self._counted = 0.0
        self._heard_at = now
        self._last: dict[str, float] = {}

    def record(self, names: Iterable[str], now: float) -> None:
        """Take in that pulses of these processes have arrived by `now`."""
        felt = list(names)
        if not felt:
            return
        self._counted += min(max(0.0, now - self._heard_at), MAX_PAUSE)
        self._heard_at = now
        for name in felt:
            self._last[name] = self._counted

    def forget(self, name: str) -> None:
        """Forget a process that has ended or is started again. It is not missed until its next pulse has arrived."""
        self._last.pop(name, None)

    def hung(self) -> list[str]:
        """The processes that have given a pulse before and are silent now while others are not."""
        return [name for name, last in self._last.items() if self._counted - last > HUNG]

    def silence(self, now: float) -> float:
        """The real time since the last pulse of any process, s."""
        return now - self._heard_at
