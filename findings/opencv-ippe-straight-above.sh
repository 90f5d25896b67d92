#!/usr/bin/env bash
# opencv-python-headless 5.0.0.93 and 4.12.0.88, numpy 2.2.6, CPython 3.11, 2026-11-29
#
# solvePnP with SOLVEPNP_IPPE, the method for points of one plane, gets four exact corners of a field of 4 by 3 m from a
# camera that looks straight down on it. In most places of the camera the pose that it returns is wrong by decimetres, or
# lies below the floor, and puts the corners tens to hundreds of pixels beside where they were seen; it reports success.
# SOLVEPNP_ITERATIVE and SOLVEPNP_SQPNP find the same poses exactly. The page of the methods asks for coplanar points,
# and does not except a plane that is parallel to the picture; above the ceiling's middle is where a laboratory hangs
# its camera. To live with it: project the points back and look at the error, and try another method, too.
. "$(dirname "$0")/setup.bash" opencv-python-headless==4.12.0.88 numpy==2.2.6
"$python" - <<'PYTHON'
from itertools import product
from math import cos, radians, sin

import cv2
import numpy as np

LENS = np.array([[800.0, 0.0, 320.0], [0.0, 800.0, 240.0], [0.0, 0.0, 1.0]])
CORNERS = np.array([[-2.0, -1.5, 0.0], [2.0, -1.5, 0.0], [2.0, 1.5, 0.0], [-2.0, 1.5, 0.0]])


def errors(method):
    """The errors of the pose, m, and of the corners that are projected back, pixels, in each place of the camera."""
    for turn, x, y, height in product((0, 30, 90, 180), (0.0, 0.5), (0.0, -0.3), (3.0, 5.0)):
        c, s, place = cos(radians(turn)), sin(radians(turn)), np.array([x, y, height])
        rotation = np.array([[c, -s, 0.0], [-s, -c, 0.0], [0.0, 0.0, -1.0]])  # it looks straight down
        seen = (CORNERS - place) @ rotation.T @ LENS.T
        pixels = seen[:, :2] / seen[:, 2:]
        done, spin, way = cv2.solvePnP(CORNERS, pixels, LENS, None, flags=method)
        assert done
        back = cv2.projectPoints(CORNERS, spin, way, LENS, None)[0].reshape(-1, 2)
        yield np.abs(-cv2.Rodrigues(spin)[0].T @ way.ravel() - place).max(), np.abs(back - pixels).max()


wrong = {}
for name in ("IPPE", "ITERATIVE", "SQPNP"):
    found = [*errors(getattr(cv2, f"SOLVEPNP_{name}"))]
    wrong[name] = sum(pixels > 1.0 for _, pixels in found)
    worst = max(place for place, _ in found)
    print(f"{name}: {wrong[name]} of {len(found)} poses put the corners a pixel and more away; worst place {worst:.3f} m")
assert wrong["IPPE"] > 10
assert wrong["ITERATIVE"] == wrong["SQPNP"] == 0
PYTHON
# Seen:
# IPPE: 29 of 32 poses put the corners a pixel and more away; worst place 10.000 m
# ITERATIVE: 0 of 32 poses put the corners a pixel and more away; worst place 0.000 m
# SQPNP: 0 of 32 poses put the corners a pixel and more away; worst place 0.000 m
