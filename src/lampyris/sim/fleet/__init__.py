"""Fleets in time: execution of plans by order of visits, reactive avoidance, lifelong tasks."""
