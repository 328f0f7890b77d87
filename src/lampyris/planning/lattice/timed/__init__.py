"""The planner ``lattice-sipp``: poses and times among obstacles whose tracks are known."""
