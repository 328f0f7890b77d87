"""Defaults that several rooms tell people of; each is declared here alone.

Texts of ``--help`` are made of them.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

Smooth: TypeAlias = Literal["straight", "arcs", "none"]
"""How a path becomes a curve, for every function, verb and file; :data:`SMOOTHING` says what each word means."""

SMOOTHING: Mapping[Smooth, str] = MappingProxyType(
    {
        "straight": "pulled straight where there is room, corners rounded as widely as there is room",
        "arcs": "along the path's own lines, corners rounded as widely as there is room",
        "none": "along the path's own lines, each corner rounded within half a step, or a stop",
    }
)

DRIVE_SPACING = 0.125
"""Cells between two nodes of the path of a drive, at most."""

SAMPLE_SPACING = 0.25
"""Cells between two nodes of a sampled path, at most."""

PROFILE_SMOOTH: Final = "none"
"""How ``lampyris.speed_profile(scene, plan)``, ``lampyris plan`` and ``lampyris speed`` drive a planned path: along its
cells, each corner rounded within half a step, or a stop."""

SAMPLE_SMOOTH: Final = "straight"
"""How ``lampyris.smooth(scene, plan)`` and ``lampyris drive`` draw a planned path."""

POINTS_SMOOTH: Final = "arcs"
"""How points given by the user (an array, a file) are driven."""

UNSEEN_COST: Final = 1.0
"""Cost of entering an unseen cell, as a multiple of its cost once it is seen."""

VIA_ORDERS: Final = ("given", "best")
VIA_ORDER: Final = VIA_ORDERS[0]
"""The order in which a path passes via points."""

SIMULATION_PATIENCE = 50
"""Consecutive ticks that the robot of a simulation waits before it gives up."""

CREEP = 0.1
"""Share of a robot's top speed that clearance and the rules beside it never take away."""

MAX_AGE = 0.5
"""Seconds after which what is known of obstacles is not trusted."""

PLANNER: Final = "ad-gso"
"""The planner of calls that name none."""

NODE_LAW: Final = "physical"
"""The speed law of a node of ROS 2."""

PRESET: Final = "robot"
"""The preset (moves and speed law) of calls that name none."""

MOBILITY: Final = "random-walk"
"""How generated obstacles move where nothing else is said."""

VALUES: Final = "occupancy"
"""What grey samples and numbers of a map mean where nothing else is said."""

COLOUR: Final = "legend"
"""How colours outside the legend of a map are read where nothing else is said: they are refused."""

RHO, GAMMA = 0.4, 0.6
"""Decay and enhancement of luciferin, the dissertation's and Krishnanand and Ghose's."""

BETA, NEIGHBOURS = 0.08, 5
"""How fast the decision range of a glowworm adapts, and how many neighbours it aims at (Krishnanand and Ghose)."""

LUCIFERIN = 5.0
"""Luciferin of a glowworm at first (Krishnanand and Ghose)."""

GATES: Final = "ignore"
"""What becomes of openings that are too narrow for the robot where nothing else is said."""

TRACKS: Final = "replayed"
"""Obstacles of a study: drawn once without the robot, the same for every planner."""

QUERY_PLANNER: Final = "astar"
"""The planner that MovingAI queries are put to where none is named."""

OUTCOMES: Mapping[str, str] = MappingProxyType({"duration": "s", "length": "m", "energy": "J/kg"})
"""What ``lampyris uncertain`` can be asked for, and its unit."""
OUTCOME = "duration"
UNCERTAINTY_METHODS = ("auto", "polynomial-chaos", "monte-carlo")
"""``auto``: an expansion, and Monte Carlo where its held-out error stays above the tolerance."""
UNCERTAINTY_METHOD = "auto"
UNCERTAINTY_TOLERANCE = 0.01
"""Share of the variance that an expansion may miss."""
EXPANSION_RUNS = 300
MONTE_CARLO_RUNS = 2000
HELD_OUT_RUNS = 30
"""Random runs that an expansion is compared with and not computed from."""
