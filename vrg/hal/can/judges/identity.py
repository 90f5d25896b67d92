"""Whether each drive is the one that has answered to its id first, by its serial number. It has no bus.

Where two drives have started again with each other's id, the robot would steer the wrong way round.
"""

from collections.abc import Iterable, Mapping, Sequence

from vrg.hal.can.axis import AxisReport
from vrg.hal.can.judges.reasons import Cause, Reason


class DriveIdentity:
    """The serial numbers that the drives of one robot must have.

    Args:
        axes: the reports of all axes of the robot.
        calibrated: the serial numbers of the drives that it was calibrated with, by node; where none is known, the one
            that answers first is meant.
    """

    def __init__(self, axes: Sequence[AxisReport], calibrated: Mapping[int, str]) -> None:
        self._axes = axes
        self._expected = {node: serial for node, serial in calibrated.items() if serial}

    def forget(self, silent: Iterable[AxisReport]) -> None:
        """These may have been switched off, and be others when they are heard again: they are to say who they are."""
        for axis in silent:
            axis.forget_serials()

    @property
    def unknown(self) -> int | None:
        """The node of a drive that has not said yet who it is, though it once could; None if there is none."""
        return next((axis.node for axis in self._axes if axis.node in self._expected and not axis.serials), None)

    def judge(self) -> Reason | None:
        """Says that a drive is not the one that it was, or shares its id; None where neither is known.

        The first one that answers, however late, is the one that is expected from then on.
        """
        for axis in self._axes:
            if axis.shared:
                return Reason(axis.node, Cause.REPORTED, (axis.shared,))
            if axis.serials and axis.serial != (expected := self._expected.setdefault(axis.node, axis.serial)):
                return Reason(axis.node, Cause.SWAPPED, (axis.serial, expected))
        return None
