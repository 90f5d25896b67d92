"""Robots with motor controllers: emulated drives on simulated buses and on real ones, and frames that are planted."""
