"""Virtual Robotic Games: games that robots play, in simulation, on hardware, or both at once.

Lengths are in metres, angles in radians and times in seconds. In every frame x is forward, y left and z up.
"""

__version__ = "0.1.0"
