"""Drives that are not there: motors, protocols and faults of motor controllers, spoken on a real or virtual CAN bus."""
