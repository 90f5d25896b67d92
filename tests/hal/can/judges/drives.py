"""Reports of drives that have just been heard, for judges, which need no more."""

from vrg.hal.can.axis import AxisReport, MotorState

NOW = 100.0
"""The time at which all has been heard, s."""


def report(node: int = 1, state: MotorState = MotorState.IDLE) -> AxisReport:
    """A drive that has said everything at NOW."""
    axis = AxisReport(node)
    axis.state, axis.on = state, state is MotorState.CLOSED_LOOP
    axis.heard = axis.reported_at = axis.measured = NOW
    return axis


def started(node: int = 1) -> AxisReport:
    """The same, in closed loop."""
    return report(node, MotorState.CLOSED_LOOP)
