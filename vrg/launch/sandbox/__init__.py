"""A player's process that runs a student's code apart: it gives up, for good, what it does not need to play."""
