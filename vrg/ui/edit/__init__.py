"""The welcome window and the configurator (thesis 3.1.3): a person chooses, changes, saves and starts a match."""
