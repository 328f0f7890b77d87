"""Loops of fleets in continuous time: execution by order of visits, and reactive collision avoidance."""
