"""What a person may have to say of a CiA 402 drive that does not say it itself."""

from typing import Literal

from pydantic import Field

from vrg.hal.can.cia402.units import INCREMENTS_PER_S
from vrg.hal.can.options import ProtocolOptions

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
    """The options of a CiA 402 drive. Each stands above what the drive says, so that a wrong answer can be corrected.

    Args:
        counts: counts of the encoder for one turn of the motor, in place of 0x608F.
        velocity_unit: the unit of its velocities, in place of 0x60A9. Turns and counts are those of the motor.
    """

    counts: float | None = Field(None, gt=0, le=2**31)
    velocity_unit: VelocityUnit | None = None

    @property
    def velocity_code(self) -> int | None:
        """The unit of velocities as 0x60A9 would have it; None where nothing is said."""
        return None if self.velocity_unit is None else UNIT_CODES[self.velocity_unit]
