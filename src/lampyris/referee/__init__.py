"""The referee: an independent check that judges paths, plans, profiles, traces, drives, fleets, swarms, and names broken rules.

It imports the nouns and NumPy, and shares no code with planners, field, motion or sim: steps are classified,
costs added up, discs laid against walls and clearances measured a second time here, by other means. Each
``check_`` returns the first :class:`Violation`, or None. :func:`demand` turns one into an
:class:`lampyris.errors.InternalFault`; :func:`certify` does both.

What it cannot see: whether a "no path" is true (the tests compare that with an exhaustive search), and, of a
trace, what happens *between* ticks beyond swaps and crossings: there obstacles are cells at ticks. Of a drive
they are discs in continuous time, and every moment of it is judged.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

from lampyris.errors import UsageError
from lampyris.model.path import Path
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.referee.motion import check_motion
from lampyris.referee.path import check_path, check_plan
from lampyris.referee.profile import check_profile
from lampyris.referee.to_go import sum_cost_to_go
from lampyris.referee.verdict import Violation, demand

if TYPE_CHECKING:
    from lampyris.model.drive import Drive
    from lampyris.model.trace import Trace
    from lampyris.referee.drive import check_drive as check_drive
    from lampyris.referee.fleets.fleet_plan import check_fleet_plan as check_fleet_plan
    from lampyris.referee.fleets.fleet_trace import check_fleet_trace as check_fleet_trace
    from lampyris.referee.fleets.lifelong import check_lifelong as check_lifelong
    from lampyris.referee.fleets.swarm import check_swarm as check_swarm
    from lampyris.referee.geometry.curve import check_curve as check_curve
    from lampyris.referee.trace import check_trace as check_trace

__all__ = [
    "Violation",
    "certify",
    "check_curve",
    "check_drive",
    "check_fleet_plan",
    "check_fleet_trace",
    "check_lifelong",
    "check_motion",
    "check_path",
    "check_plan",
    "check_profile",
    "check_swarm",
    "check_trace",
    "demand",
    "sum_cost_to_go",
]


_LATER = {
    "check_curve": "geometry.curve",
    "check_drive": "drive",
    "check_fleet_plan": "fleets.fleet_plan",
    "check_fleet_trace": "fleets.fleet_trace",
    "check_lifelong": "fleets.lifelong",
    "check_swarm": "fleets.swarm",
    "check_trace": "trace",
}
"""Functions to their modules."""


def __getattr__(name: str) -> Any:
    # Loaded when they are asked for: who plans drives nothing yet.
    if name not in _LATER:
        raise AttributeError(f"module 'lampyris.referee' has no attribute {name!r}")
    found = getattr(import_module(f"lampyris.referee.{_LATER[name]}"), name)
    globals()[name] = found
    return found


_Judged = TypeVar("_Judged", Path, Plan, Profile, "Trace", "Drive")


def certify(result: _Judged, scene: Scene | None = None, path: Path | None = None) -> _Judged:
    """The same result, certified: it comes back only if no rule is broken.

    Parameters
    ----------
    result : a path or plan (needs ``scene``), a profile (needs ``scene``, and ``path`` or its own ``xy``), or
        a trace or a drive (they bring their own scene).

    Raises
    ------
    InternalFault : the referee refuses it.
    UsageError : what it is to be judged against is missing.
    """
    from lampyris.model.drive import Drive
    from lampyris.model.trace import Trace

    if isinstance(result, Trace):
        from lampyris.referee.trace import check_trace

        demand(check_trace(result))
        return result
    if isinstance(result, Drive):
        from lampyris.referee.drive import check_drive

        demand(check_drive(result))
        return result
    if scene is None or (isinstance(result, Profile) and path is None and result.xy is None):
        raise UsageError(
            "CERTIFY",
            f"a {type(result).__name__} alone",
            allowed="with its scene, and a profile with its path",
        )
    if isinstance(result, Plan):
        demand(check_plan(result, scene))
    elif isinstance(result, Profile):
        demand(check_profile(result, path, scene))
    else:
        demand(check_path(result, scene.grid, scene.robot, scene.moves, scene.start, scene.goal))
    return result
