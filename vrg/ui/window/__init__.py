"""Windows by pygame: the spectator's, replays, and what they and the others have in common."""
