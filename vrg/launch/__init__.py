"""Starting a match: in one process, or as supervised processes."""
