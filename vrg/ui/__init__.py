"""The user interfaces: windows, the web page, the table in the terminal, the plot of the trajectories."""

import os

# pygame greets on standard output when it is imported; a script that reads ours wants none of that.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
