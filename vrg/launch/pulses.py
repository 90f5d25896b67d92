"""Finds the processes that hang: those that work by comparing them, and those that start by what they compute.

A process that gives no sign of life hangs. But if no process gives any, the whole machine has stalled, and none of them
is at fault. So silence is not measured in real time: the time that counts goes on only while some process is heard.
This module uses no bus and reads no clock.
"""

from collections.abc import Iterable

import psutil

HUNG = 2.5
"""The time in s without a pulse, while others are heard, after which a process is taken to hang. Pulses come every
0.5 s."""
MAX_PAUSE = 1.0
"""The longest time in s that counts for a pause in which no process was heard."""

IDLE_TIMEOUT = 30.0
"""The real time in s that a process may do nothing at all before it is ready."""
BUSY_TIMEOUT = 60.0
"""The processor time in s that a process may use before it is ready. An endless loop would use more."""
_WORKS = 0.01
"""The processor time in s that a process must use between two looks; less counts as doing nothing."""
_STALL = 2.0
"""The longest real time in s that counts for a pause between two looks."""


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


class StartupProbe:
    """The progress of one process that is not ready, and of those that it has started, measured as processor time.

    So it is waited for on a slow and busy machine, too.

    Args:
        now: the monotonic time at which it is started, s. busy: the most processor time that it may use, s.
    """

    def __init__(self, now: float, busy: float = BUSY_TIMEOUT) -> None:
        self._busy = busy
        self._looked, self._idle, self._worked = now, 0.0, 0.0

    def stuck(self, pid: int, now: float) -> str | None:
        """The reason, in words, why the process will never be ready; None as long as it makes progress, or has ended.

        Args:
            pid: of the process. now: the monotonic time, s.
        """
        used = 0.0
        try:
            process = psutil.Process(pid)
            for one in (process, *process.children(recursive=True)):
                times = one.cpu_times()
                used += times.user + times.system
        except psutil.Error:
            return None
        # Where the whole machine has stalled, this process was not idle for longer than the others.
        self._idle += min(now - self._looked, _STALL)
        self._looked = now
        if abs(used - self._worked) > _WORKS:
            self._idle, self._worked = 0.0, used
        if used > self._busy:
            return f"has used {used:.0f} s of processor time but is not ready"
        if self._idle > IDLE_TIMEOUT:
            return f"is not ready and has done nothing for {IDLE_TIMEOUT:g} s"
        return None
