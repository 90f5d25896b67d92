"""The workshop of one protocol: its emulated drive, and its listener."""
