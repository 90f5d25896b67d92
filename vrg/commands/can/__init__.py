"""The commands `vrg can`."""
