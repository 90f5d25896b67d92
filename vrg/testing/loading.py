"""What code loads, in a Python of its own."""

import subprocess
import sys


def loaded(code: str, names: tuple[str, ...]) -> list[str]:
    """Those of these modules that code loads."""
    code = f"import sys\n{code}\nprint(*(m for m in {names} if m in sys.modules))"
    out = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=600, check=True)
    return out.stdout.split()
