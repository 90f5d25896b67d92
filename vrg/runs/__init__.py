"""What a match leaves: its run folder, and what is read from it or made of it."""
