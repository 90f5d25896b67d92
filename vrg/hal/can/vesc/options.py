"""What a person must say of a VESC."""

from pydantic import Field

from vrg.hal.can.options import ProtocolOptions


class VescOptions(ProtocolOptions):
    """The options of a VESC, which counts electrical revolutions and does not tell how many make one of the shaft.

    Args:
        pole_pairs: pairs of magnetic poles of the motor, half the number of its magnets. It must be said.
    """

    pole_pairs: int | None = Field(None, ge=1, le=100)
