"""The robot device: one interface to every robot, virtual or physical."""
