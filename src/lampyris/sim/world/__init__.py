"""The state of a simulation: cells, obstacles, trajectories, endings."""
