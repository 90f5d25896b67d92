"""How often each rigid body is used. Pure."""


class Pace:
    """Takes each body at most so many times a second.

    Each is counted by itself: by VRPN the bodies come apart, with empty frames between them, so a count of frames would
    leave out most of what has been measured, and of two bodies perhaps always the same one.

    Args:
        rate: the most measurements of each body in a second.
    """

    def __init__(self, rate: float) -> None:
        self._period = 1.0 / rate
        self._due: dict[str | None, float] = {}

    def takes(self, body: str | None, now: float) -> bool:
        """True if a measurement is taken.

        Args:
            body: its name; None for a frame without bodies. now: when it came, s.
        """
        due = self._due.get(body, now)
        if now < due:
            return False
        # They do not come quite evenly, so that the time between two is measured over many.
        self._due[body] = max(due, now - self._period) + self._period
        return True
