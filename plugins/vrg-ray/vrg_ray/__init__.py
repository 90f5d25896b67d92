"""Plays the games of comparisons and tournaments on a cluster of Ray."""
