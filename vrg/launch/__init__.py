"""The launcher, which starts a match in one process or as supervised processes."""
