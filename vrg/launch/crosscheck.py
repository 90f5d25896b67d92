"""Compares a recording with the evidence of the referee: two witnesses, who saw the same robots. Pure."""

import math
from collections.abc import Sequence

from vrg.coordinator.evidence import Exhibit
from vrg.coordinator.judging import Disagreement
from vrg.recording.reader import Track

TOLERANCE = 1e-6
"""The difference in m or rad from which on two poses are not the same: recordings have all digits."""


def cross_check(tracks: Sequence[Track], exhibits: Sequence[Exhibit]) -> tuple[list[Disagreement], int]:
    """Where a recording shows a robot elsewhere than the referee saw it.

    Only instants of which both tell count. Each robot is told once, with the first instant and how many there are.

    Returns:
        the disagreements, and the number of poses that were compared.
    """
    seen = {round(exhibit.tick.field.time, 6): exhibit.tick.field.poses for exhibit in exhibits}
    found: list[Disagreement] = []
    compared = 0
    for track in tracks:
        wrong: list[tuple[float, float]] = []
        for time, x, y, theta in zip(track.times, track.x, track.y, track.theta, strict=True):
            pose = seen.get(round(float(time), 6), {}).get(track.name)
            if pose is None:
                continue
            compared += 1
            distance = math.hypot(x - pose.x, y - pose.y)
            turned = abs(math.remainder(theta - pose.theta, math.tau))
            if max(distance, turned) > TOLERANCE:
                wrong.append((float(time), distance))
        if wrong:
            time, distance = wrong[0]
            often = "" if len(wrong) == 1 else f", and at {len(wrong) - 1} further instants"
            text = f"the recording shows {track.name} {distance:.3f} m from where the referee saw it{often}"
            found.append(Disagreement(time, text))
    return found, compared
