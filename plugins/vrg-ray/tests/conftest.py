"""The contract of what plays games stands beside the tests of vrg-league."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "vrg-league" / "tests"))
