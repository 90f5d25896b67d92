"""What people see and touch: the spectator's window, the table in the terminal, the plot of the trajectories."""
