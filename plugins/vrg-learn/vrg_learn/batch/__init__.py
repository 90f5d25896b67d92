"""Many matches at once in arrays: the same rules and the same physics as a match, compiled where numba is there."""
