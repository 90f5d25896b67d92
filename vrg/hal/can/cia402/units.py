"""The units of a drive's numbers: encoder counts and the drive's own unit of velocity."""

from typing import NamedTuple


class Units(NamedTuple):
    """What a drive's numbers mean.

    Args:
        counts: counts of the encoder for one turn of the shaft (0x608F).
        velocity: the drive's units of velocity in 1 turn/s (0x60A9).
    """

    counts: float
    velocity: float

    @property
    def wrap(self) -> float:
        """The number of turns after which the position, which has 32 bits, begins anew."""
        return 2**32 / self.counts

    def turns(self, counts: int) -> float:
        """Turns of the shaft for a position in counts."""
        return counts / self.counts

    def turns_per_s(self, velocity: int) -> float:
        """turn/s of the shaft for a velocity in the drive's units."""
        return velocity / self.velocity

    def velocity_of(self, turns_per_s: float) -> int:
        """The velocity in the drive's units, rounded, and limited to what fits into 32 bits."""
        return round(max(-(2.0**31), min(2.0**31 - 1, turns_per_s * self.velocity)))


_REVOLUTIONS, _INCREMENTS, _MINUTES, _SECONDS = 0xB4, 0xB5, 0x47, 0x03
"""Codes of units (CiA 303-2)."""
INCREMENTS_PER_S = _INCREMENTS << 16 | _SECONDS << 8
"""The velocity unit increments/s, as 0x60A9 has it."""


def units(increments: float, revolutions: int, velocity_unit: int | None) -> Units | None:
    """The units by 0x608F:01, 0x608F:02 and 0x60A9, or None where they make no sense or are not known.

    The highest byte of the velocity unit is a power of ten, and then come the codes of what is counted, revolutions or
    increments, and of the time, minutes or seconds: 0x00B44700 is 1/min, 0xFDB44700 0.001/min. A drive that has no such
    object, or says 0 there, leaves its unit to its manual.
    """
    if increments <= 0 or revolutions <= 0 or not velocity_unit:
        return None
    counts = increments / revolutions
    prefix, counted, time, rest = velocity_unit.to_bytes(4, "big")
    per_turn = {_REVOLUTIONS: 1.0, _INCREMENTS: counts}.get(counted)
    per_second = {_MINUTES: 60.0, _SECONDS: 1.0}.get(time)
    if per_turn is None or per_second is None or rest:
        return None
    return Units(counts, per_turn * per_second / 10.0 ** (prefix - 256 if prefix > 127 else prefix))
