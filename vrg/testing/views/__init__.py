"""Views of a match: a match that is made up, windows, and the page in a browser."""
