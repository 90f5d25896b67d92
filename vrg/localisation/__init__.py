"""The places of robots: fixes from outside, and the estimators that fuse them with what robots measure themselves."""
