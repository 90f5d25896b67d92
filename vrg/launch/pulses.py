"""Who hangs, judged by the others. Pure.

A process that gives no sign of life hangs; but where nobody gives any, the whole machine has stalled, and nobody is to
blame. So silence is not measured in real time: the time that counts goes on only while somebody is heard.
"""

from collections.abc import Iterable

HUNG = 2.5
"""s without a pulse, while others give theirs, after which a process is taken to hang; it beats every 0.5 s."""
STEP = 1.0
"""s; a pause in which nobody was heard counts for no more than this."""


class Pulses:
    """The signs of life of several processes.

    Args:
        now: monotonic s.
    """

    def __init__(self, now: float) -> None:
        self._counted = 0.0
        self._heard_at = now
        self._last: dict[str, float] = {}

    def feel(self, names: Iterable[str], now: float) -> None:
        """Pulses of these processes have arrived by `now`."""
        felt = list(names)
        if not felt:
            return
        self._counted += min(max(0.0, now - self._heard_at), STEP)
        self._heard_at = now
        for name in felt:
            self._last[name] = self._counted

    def forget(self, name: str) -> None:
        """A process has ended or begins anew: it is not missed until it has been felt again."""
        self._last.pop(name, None)

    def hung(self) -> list[str]:
        """The processes that were felt once and now are silent while others are not."""
        return [name for name, last in self._last.items() if self._counted - last > HUNG]

    def silence(self, now: float) -> float:
        """s of real time since anybody was felt."""
        return now - self._heard_at
