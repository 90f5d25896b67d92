"""The view in three dimensions."""
