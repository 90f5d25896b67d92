"""Judges whether the drives' own watchdogs work: each must stop its motor once, as it gets no setpoints."""

import enum
from collections.abc import Collection, Iterable

from vrg.hal.can.axis import AxisReport
from vrg.hal.can.judges.reasons import Cause, Reason

PROOF_TIMEOUT = 0.33
"""s from the last setpoint within which every drive must report that its own watchdog has stopped its motor, when that
is proved: 0.2 s, and the way of the report."""
PROOFS = 2
"""Times that a watchdog is tried: on a busy computer the first setpoint may leave late, or a report may get lost."""


class ProofStep(enum.Enum):
    """What follows of a look at the watchdogs."""

    WAIT = enum.auto()
    AGAIN = enum.auto()
    PROVED = enum.auto()


class WatchdogProof:
    """Judges the watchdogs of the drives of one robot.

    Attributes:
        pending: they have not been seen to work since the robot was connected or recovered, or are in doubt.
        proved: the nodes whose watchdogs have been seen to work since the robot was armed.
    """

    def __init__(self) -> None:
        self.pending = True
        self.proved: set[int] = set()
        self._tries, self._proved_before = 0, False

    def begin(self, axes: Iterable[AxisReport]) -> None:
        """Judge again from here."""
        self._tries, self._proved_before = 0, False
        self.doubt(axes)

    def doubt(self, axes: Iterable[AxisReport]) -> None:
        """The watchdogs are to be proved at the next start, if there are any."""
        self.pending = not all(axis.unwatched for axis in axes)

    def judge(
        self, axes: Collection[AxisReport], started: Collection[int], uncommanded: float, *, disturbed: bool
    ) -> ProofStep | Reason:
        """Judge whether every drive's own watchdog has stopped its motor, or whether that is to be tried once more.

        Args:
            axes: the reports of all drives. started: the nodes that have been in closed loop since the robot was armed.
            uncommanded: s since the last setpoint, which is withheld once every motor has started.
            disturbed: a drive may have had no chance, as it was not asked, or not heard.
        """
        watched = [axis for axis in axes if not axis.unwatched]
        late = uncommanded > PROOF_TIMEOUT
        if not late:
            self.proved |= {axis.node for axis in watched if axis.expiry_reported and axis.node in started}
        missing = [axis.node for axis in watched if axis.node not in self.proved]
        if not missing:
            self.pending, self._proved_before, self._tries = False, True, 0
            return ProofStep.PROVED
        if not late or any(axis.node not in started for axis in axes):
            return ProofStep.WAIT
        self._tries += not disturbed
        if self._tries < PROOFS:
            return ProofStep.AGAIN
        return Reason(missing[0], Cause.UNPROVED_NOW if self._proved_before else Cause.UNPROVED, (PROOF_TIMEOUT,))
