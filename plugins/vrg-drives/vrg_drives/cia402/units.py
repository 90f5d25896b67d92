"""The units of a drive's numbers: encoder counts and the drive's own unit of velocity."""

from typing import Literal, NamedTuple

from pydantic import Field

from vrg.hal.can.axis import ProtocolOptions


class Units(NamedTuple):
    """The units of a drive's numbers.

    Args:
        counts: counts of the encoder for one turn of the shaft (0x608F).
        velocity: the drive's units of velocity in 1 turn/s (0x60A9).
    """

    counts: float
    velocity: float

    def __str__(self) -> str:
        return f"{self.counts:g} counts in a turn, {self.velocity:g} units of velocity in 1 turn/s"

    @property
    def wrap(self) -> float:
        """The number of turns after which the position, which has 32 bits, starts again."""
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
    object, or has 0 there, leaves its unit to its manual.
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


VelocityUnit = Literal["counts/s", "counts/min", "1/s", "1/min", "0.1/min", "0.01/min", "0.001/min"]

UNIT_CODES: dict[VelocityUnit, int] = {
    "counts/s": INCREMENTS_PER_S,
    "counts/min": 0x00B54700,
    "1/s": 0x00B40300,
    "1/min": 0x00B44700,
    "0.1/min": 0xFFB44700,
    "0.01/min": 0xFEB44700,
    "0.001/min": 0xFDB44700,
}
"""The units as 0x60A9 would have them (CiA 303-2)."""


class Cia402Options(ProtocolOptions):
    """The options of a CiA 402 drive. Each overrides the drive's own object, so that a wrong one can be corrected.

    Args:
        counts: counts of the encoder for one turn of the motor, in place of 0x608F.
        velocity_unit: the unit of its velocities, in place of 0x60A9. Turns and counts are those of the motor.
    """

    counts: float | None = Field(None, gt=0, le=2**31)
    velocity_unit: VelocityUnit | None = None

    @property
    def velocity_code(self) -> int | None:
        """The unit of velocities as 0x60A9 would have it; None if it is not given."""
        return None if self.velocity_unit is None else UNIT_CODES[self.velocity_unit]
