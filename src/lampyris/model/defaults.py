"""Defaults that several rooms tell people of; each is declared here alone.

Nothing is imported: texts of ``--help`` are made of them.
"""

DRIVE_SPACING = 0.125
"""Cells between two nodes of the path of a drive, at most."""

COURSE_SPACING = 0.25
"""Cells between two nodes of a course, at most."""

SIMULATION_PATIENCE = 50
"""Ticks in a row that the robot of a simulation waits before it gives up."""
