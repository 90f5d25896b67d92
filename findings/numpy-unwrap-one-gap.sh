#!/usr/bin/env bash
# numpy 2.4.6, CPython 3.11, 2026-11-29
#
# np.unwrap makes a continuous angle of headings between -pi and pi. One NaN in them, as recordings have where a sensor
# gave no reading, makes every later value NaN, not that one alone: it sums up corrections, and the sum never recovers.
# The page of the function does not mention NaN. Whoever draws or differentiates the heading of a match loses all that
# came after the first dropped reading. To live with it: unwrap what is finite
# (`angles[good] = np.unwrap(angles[good])`), and leave the gaps where they are.
. "$(dirname "$0")/setup.bash" numpy==2.4.6
"$python" - <<'PYTHON'
import numpy as np

headings = np.array([3.0, 3.1, np.nan, -3.1, -3.0, -2.9])
whole = np.unwrap(headings)
print("headings:    ", headings)
print("unwrapped:   ", whole)
assert np.isfinite(whole[:2]).all()
assert np.isnan(whole[2:]).all()
good = np.isfinite(headings)
apart = headings.copy()
apart[good] = np.unwrap(headings[good])
print("without gaps:", apart.round(2))
assert np.isfinite(apart).sum() == 5
PYTHON
# Seen:
# headings:     [ 3.   3.1  nan -3.1 -3.  -2.9]
# unwrapped:    [3.  3.1 nan nan nan nan]
# without gaps: [3.   3.1   nan 3.18 3.28 3.38]
