"""Virtual Robotic Games: games that robots play, in simulation, on hardware, or both at once.

Lengths in metres, angles in radians, times in seconds. Frames: x forward, y left, z up.
"""

__version__ = "0.1.0"
