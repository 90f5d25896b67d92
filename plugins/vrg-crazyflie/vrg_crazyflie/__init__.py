"""Crazyflie 2.1 quadrotors, which move in the plane as VRG's other robots do, and up and down."""
