"""Navigation: control laws and the avoidance of bodies and borders, as functions of numbers.

Players use it, and the coordinator, where it drives a robot itself.
"""
