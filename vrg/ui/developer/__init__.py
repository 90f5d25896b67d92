"""The developers' view: all players and the coordinator at once, and what every stream and process is like."""
