"""A planner of continuous poses: hybrid A*."""
