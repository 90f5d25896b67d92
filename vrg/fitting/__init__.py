"""What a robot's own numbers are, by what it did: how it follows commands, and how its odometry errs."""
