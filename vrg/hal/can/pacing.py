"""How quickly frames may be sent without filling the transmit queue of an interface: numbers alone.

Linux gives a CAN interface a queue of ten frames, and it should be no longer: what waits there is old when it goes out.
A program that sends more at once gets an error. So ordinary frames leave room in the queue for those that switch motors
off, which never wait here.
"""

ROOM = 6
"""Ordinary frames that may be under way at once. Four places are left for frames that stop the motors of a robot."""
FRAME_TIME = 0.6e-3
"""s that a frame takes at most at 250 kbit/s (135 bits with the worst stuffing and the space between frames). Buses are
rarely slower, and on a faster one nothing is lost but a few milliseconds at a start."""


class Pacer:
    """A bucket of ROOM tokens, one for each frame, which comes back as the frame is through. Times are monotonic, s."""

    def __init__(self) -> None:
        self._busy_until = 0.0

    def delay(self, now: float) -> float:
        """s to wait before an ordinary frame may be sent."""
        return max(0.0, self._busy_until - now - (ROOM - 1) * FRAME_TIME)

    def sent(self, now: float) -> None:
        """A frame, of whatever kind, has been sent."""
        self._busy_until = max(self._busy_until, now) + FRAME_TIME
