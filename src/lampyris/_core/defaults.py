"""Defaults that several rooms tell people of; each is declared here alone.

Texts of ``--help`` are made of them.
"""

from typing import Final

DRIVE_SPACING = 0.125
"""Cells between two nodes of the path of a drive, at most."""

COURSE_SPACING = 0.25
"""Cells between two nodes of a course, at most."""

PROFILE_SMOOTH: Final = "none"
"""How ``lampyris.speed_profile(scene, plan)``, ``lampyris plan`` and ``lampyris speed`` drive a planned path: along its
cells, each corner rounded within half a step, or a stop."""

COURSE_SMOOTH: Final = "taut"
"""How ``lampyris.smooth(scene, plan)`` draws a planned path, and a drive by its ``arcs``."""

POINTS_SMOOTH: Final = "arcs"
"""How points that somebody gave (an array, a file) are driven: along their own lines, corners rounded."""

SIMULATION_PATIENCE = 50
"""Ticks in a row that the robot of a simulation waits before it gives up."""
