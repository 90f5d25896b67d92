"""Learning: environments in which programs learn to play, thousands of matches at once, and policies that play."""
