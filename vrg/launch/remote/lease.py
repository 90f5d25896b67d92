"""The lease under which an agent supervises processes. This module reads no clock."""

LEASE = 10.0
"""The real time in s without any sign of the launcher after which an agent stops its processes and ends."""


class Lease:
    """Lapses when nothing is heard of the launcher, neither over ssh nor on the bus.

    Either way suffices: the ssh connection may stall while the match goes on, and the bus is away while the router is
    started again. Robots do not wait for this lease: each stands as soon as its player, the referee or the clock is
    silent.

    Args:
        now: the monotonic time, s; so in all methods.
    """

    def __init__(self, now: float) -> None:
        self._renewed = now

    def renew(self, now: float) -> None:
        """Something was heard of the launcher."""
        self._renewed = max(self._renewed, now)

    def lapsed(self, now: float) -> bool:
        """Whether nothing has been heard for too long."""
        return now - self._renewed > LEASE
