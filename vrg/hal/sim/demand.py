"""The demand for pictures: the robots of whose cameras pictures are requested now."""

from collections.abc import Collection


class Demand:
    """The robots of whose cameras pictures are wanted.

    Args:
        always: the names of the robots whose pictures are always wanted.
    """

    def __init__(self, always: Collection[str] = ()) -> None:
        self._always = frozenset(always)
        self._until: dict[str, float] = {}

    def ask(self, robot: str, now: float, lease: float) -> None:
        """Want pictures of a robot's camera from match time `now` on for `lease` seconds. It never ends another lease.

        A viewer asks again before the lease ends.
        """
        self._until[robot] = max(now + lease, self._until.get(robot, 0.0))

    def at(self, now: float) -> frozenset[str]:
        """The names of the robots at match time `now`."""
        if not self._until:
            return self._always
        self._until = {robot: until for robot, until in self._until.items() if until > now}
        return self._always.union(self._until)
