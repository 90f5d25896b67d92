"""Pictures by matplotlib: trajectories and proofs."""
