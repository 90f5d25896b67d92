"""The head-up display of one player (thesis 4.1): what the player knows, and a person who sends or drives its robot."""
