"""Crazyflie 2.1 quadrotors, which fly at one height and move in the plane as VRG's other robots do."""
