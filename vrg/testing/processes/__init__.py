"""Matches of real processes, and programs beside them."""
