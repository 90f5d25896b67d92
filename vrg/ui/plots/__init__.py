"""Pictures by matplotlib: trajectories, comparisons and proofs."""
