"""What a person must say of a VESC."""

from pydantic import Field

from vrg.hal.can.options import ProtocolOptions


class VescOptions(ProtocolOptions):
    """The options of a VESC, which counts electrical revolutions and does not tell how many make one of the shaft.

    Args:
        pole_pairs: pairs of magnetic poles of the motor, half the number of its magnets. It must be said.
    """

    pole_pairs: int | None = Field(None, ge=1, le=100)

    @property
    def missing(self) -> str | None:
        """The pole pairs."""
        if self.pole_pairs is not None:
            return None
        return (
            "expected to know how many pole pairs its motor has, as a VESC counts electrical revolutions: write "
            "pole_pairs into [backends.can.robots.<name>.options]; it is half the number of magnets"
        )
