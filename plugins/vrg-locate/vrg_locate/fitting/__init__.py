"""A robot's own numbers, by what it did: how it follows commands, and how its odometry errs."""
