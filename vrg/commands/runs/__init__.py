"""The commands `vrg run`."""
