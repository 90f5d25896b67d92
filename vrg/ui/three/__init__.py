"""The view of a match in three dimensions, for browsers. All but `theatre.py` is made of numbers alone."""
