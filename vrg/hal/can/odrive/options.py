"""What a person may say of an ODrive."""

from pydantic import Field, model_validator

from vrg.hal.can.options import ProtocolOptions


class OdriveOptions(ProtocolOptions):
    """The options of an ODrive. Whoever says none leaves its own limits as they were saved in it.

    Args:
        velocity_limit: the highest speed of the motor, turn/s. current_limit: its highest current, A. Both are given,
            or none: one message sets both, each time that the robot connects.
    """

    velocity_limit: float | None = Field(None, gt=0, le=10_000)
    current_limit: float | None = Field(None, gt=0, le=1_000)

    @model_validator(mode="after")
    def _both(self) -> "OdriveOptions":
        if (self.velocity_limit is None) != (self.current_limit is None):
            raise ValueError("expected velocity_limit and current_limit, or neither: one message sets both")
        return self
