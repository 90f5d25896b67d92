"""Where robots are: fixes from outside, and the estimators that fuse them with what robots measure themselves."""
