"""The page in browsers."""
