"""What a person may say of a moteus controller."""

from pydantic import Field

from vrg.hal.can.options import ProtocolOptions


class MoteusOptions(ProtocolOptions):
    """The options of a moteus controller.

    Args:
        max_torque: the highest torque of the motor, Nm, sent with each setpoint; None leaves it to the drive.
    """

    max_torque: float | None = Field(None, gt=0, le=1_000)
