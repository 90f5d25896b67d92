"""Compares a recording with the evidence of the referee: two witnesses, who saw the same robots. Pure."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from vrg.coordinator.evidence import Exhibit
from vrg.coordinator.judging import Disagreement
from vrg.recording.reader import RobotPoses

TOLERANCE = 1e-6
"""The difference in m or rad from which on two poses are not the same: recordings have all digits."""

STEP_BACK = 0.3
"""The match time in s that the first instant which the referee notes after the world stepped back may be late."""


def cross_check(tracks: Sequence[RobotPoses], exhibits: Iterable[Exhibit]) -> tuple[list[Disagreement], int]:
    """Compare a recording with the referee's evidence, and return the robots and times at which their poses differ.

    Only instants that both have count, and of those to which the world stepped back none that the referee saw before.
    Each robot is reported once, with the first instant and how many there are.

    Returns:
        the disagreements, and the number of poses that were compared.
    """
    # If an instant was seen again after the world stepped back in time, the later view counts.
    known = [(track, np.rint(track.times * 1e6), np.full((2, len(track.times)), np.nan)) for track in tracks]
    before = -math.inf
    for exhibit in exhibits:
        if exhibit.tick.time < before:
            # While play is halted the referee notes nothing, so that it may not have noted these instants again.
            for _, times, gaps in known:
                gaps[:, times >= 1e6 * (exhibit.tick.time - STEP_BACK)] = np.nan
        before = exhibit.tick.time
        time = round(exhibit.tick.field.time * 1e6)
        for track, times, gaps in known:
            pose = exhibit.tick.field.poses.get(track.name)
            at = int(np.searchsorted(times, time))
            if pose is not None and at < len(times) and times[at] == time:
                distance = math.hypot(track.x[at] - pose.x, track.y[at] - pose.y)
                gaps[:, at] = distance, max(distance, abs(math.remainder(track.theta[at] - pose.theta, math.tau)))
    found: list[Disagreement] = []
    for track, _, (distances, gap) in known:
        wrong = np.flatnonzero(gap > TOLERANCE)
        if len(wrong):
            first = wrong[0]
            often = "" if len(wrong) == 1 else f", and at {len(wrong) - 1} further instants"
            text = f"the recording shows {track.name} {distances[first]:.3f} m from where the referee saw it{often}"
            found.append(Disagreement(float(track.times[first]), text))
    return found, sum(int(np.isfinite(gap).sum()) for _, _, (_, gap) in known)
