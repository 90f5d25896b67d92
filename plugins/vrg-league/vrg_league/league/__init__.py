"""A league: a tournament that goes on for weeks, between entries whose authors change them."""
