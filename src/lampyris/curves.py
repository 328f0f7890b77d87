"""Shortest curves of bounded curvature between two poses.

Dubins curves are for cars that only drive ahead, Reeds-Shepp curves for those that also drive in reverse::

    curve = lampyris.curves.reeds_shepp((0, 0, 0), (2, 1, 1.57), turn_radius=1.0)
    print(curve.word, curve.length, curve.poses(spacing=0.1))

Both ignore obstacles; the planner ``hybrid-astar`` takes them into account.
"""

from __future__ import annotations

from lampyris.motion.geometry.shortest_curve import ShortestCurve as ShortestCurve
from lampyris.motion.geometry.shortest_curve import dubins as dubins
from lampyris.motion.geometry.shortest_curve import dubins_lengths as dubins_lengths
from lampyris.motion.geometry.shortest_curve import reeds_shepp as reeds_shepp
from lampyris.motion.geometry.shortest_curve import reeds_shepp_lengths as reeds_shepp_lengths

__all__ = ["ShortestCurve", "dubins", "dubins_lengths", "reeds_shepp", "reeds_shepp_lengths"]
