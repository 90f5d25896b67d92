"""How well the estimator locates robots: its error against the truth in seeded runs, and whether it knows its error.

Robots drive at up to 0.7 m/s in the planar world, each with the odometry that its seed gives it. They are located by
odometry alone, or with the fixes of a simulated camera. The position error is the distance to the truth at the time of
the newest odometry. Consistency is the mean normalised estimation error squared of the pose (Y. Bar-Shalom, X. R. Li,
T. Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.4): 3 where the covariance is
right, below it where the estimator is too modest.
"""

import math
import sys
from pathlib import Path

import numpy as np
from common import arguments, show
from scipy.stats import chi2

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.localisation.driving import Drive

CASES = {
    "odometry alone": None,
    "5 Hz": {"rate": 5.0},
    "15 Hz": {"rate": 15.0},
    "30 Hz": {"rate": 30.0},
    "15 Hz, 20 % lost, 150 ms late": {"rate": 15.0, "loss": 0.2, "delay": 0.15},
    "5 Hz, 20 % lost, 150 ms late": {"rate": 5.0, "loss": 0.2, "delay": 0.15},
}
ROBOTS = 10


def main() -> None:
    """Run the benchmark, and print its table."""
    parser = arguments(__doc__)
    parser.add_argument("--runs", type=int, default=1000, help="the number of robots that are driven in each case")
    parser.add_argument("--for", type=float, default=60.0, dest="seconds", help="the match time of each, s")
    options = parser.parse_args()
    runs = 20 if options.quick else options.runs
    rows = []
    for words, camera in CASES.items():
        drives = [Drive(seed, camera, options.seconds, ROBOTS) for seed in range(max(1, runs // ROBOTS))]
        errors = np.concatenate([drive.errors for drive in drives])  # (robots, times, 3)
        nees = np.concatenate([drive.nees for drive in drives])
        far, turned = np.hypot(errors[..., 0], errors[..., 1]), np.abs(errors[..., 2])
        # Of independent runs at one instant: the mean of n of them is within these bounds with 95 %.
        n = len(nees)
        low, high = chi2.ppf([0.025, 0.975], 3 * n) / n
        at = nees.mean(axis=0)
        rows.append(
            {
                "located by": words,
                "robots": n,
                "rms, cm": round(100 * math.sqrt((far**2).mean()), 2),
                "95 %, cm": round(100 * float(np.quantile(far, 0.95)), 2),
                "rms, degrees": round(math.degrees(math.sqrt((turned**2).mean())), 2),
                "95 %, degrees": round(math.degrees(float(np.quantile(turned, 0.95))), 2),
                "NEES": round(float(nees.mean()), 2),
                "in bounds, %": round(100 * float(((at > low) & (at < high)).mean())),
                "refused, %": round(100 * sum(d.refused for d in drives) / max(1, sum(d.fixes for d in drives)), 2),
            }
        )
    show(f"{rows[0]['robots']} robots, {options.seconds:g} s each", rows, [], as_json=options.json)


if __name__ == "__main__":
    main()
