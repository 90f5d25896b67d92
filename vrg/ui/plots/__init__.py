"""Pictures by matplotlib: trajectories, comparisons, proofs, and what is printed."""
