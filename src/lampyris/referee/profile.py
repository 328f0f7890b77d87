"""Profiles: whether the robot can drive these speeds, may drive them, and arrives in the stated time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.grid import Grid
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.referee.dissertation import check_dissertation
from lampyris.referee.geometry.shapes import wall_distance
from lampyris.referee.motion import check_motion, first, rest_to_rest
from lampyris.referee.verdict import Violation
from lampyris.typing import BoolGrid, Floats, Points

ROUNDING = 1e-9
"""Share of a bound that lengths along a path and distances to walls may be off by."""

CREEP = 0.1
"""Share of v_max that no clearance takes away, unless the law was given another."""

_TOGETHER = 4_096
"""Places whose walls are looked up at once."""

Bound: TypeAlias = tuple[str, Floats]
"""The name of a rule and the maximum speed it allows at each node, m/s (n,); infinity where it is silent."""

LawCap: TypeAlias = Callable[[Profile, Points, Scene, float], Bound]
"""A rule of a law: profile, places of its nodes (cells, (n, 2)), scene and creep to a bound."""


def check_profile(
    profile: Profile,
    planned: Path | None,
    scene: Scene,
    *,
    v0: float = 0.0,
    creep: float = CREEP,
    slowest: float | None = None,
    corners: bool = False,
    stops: bool = False,
    curve: Curve | None = None,
) -> Violation | None:
    """Whether a profile keeps its law at every node and between nodes.

    Rules: ``nodes``, ``law``, ``s``; for the dissertation's law ``speed``, ``goal``, ``start``,
    ``acceleration``, ``braking``, ``angle``, ``ring``, ``a``, ``time``; for every other those of
    :func:`lampyris.referee.motion.check_motion` with the robot's limits, to 1e-12 (that on jerk where the law
    promises it: all but those of :data:`JERKY`), and the caps of the law in :data:`LAWS`, such as
    ``clearance``. The first broken one is reported, at its first node.

    Parameters
    ----------
    profile, scene : judged. Moving obstacles are not known here: they only ever make a robot slower, so every
        bound asked for holds with them too.
    planned : the path that was asked for, taken as checked. Without ``profile.xy`` its nodes are the path's
        cells, in a metric law with waits among them. With ``xy`` only the ends must be the path's: that the
        curve between them is free is for :mod:`lampyris.referee.geometry.curve` to say. None: ``xy`` alone, and
        nothing is asked of its ends.
    v0 : speed at the first node, in the law's units. The dissertation's law may lower it, every other must
        keep it.
    creep : share of v_max that no wall takes away.
    slowest : m/s, what no rule of the law goes below; None: creep. Not required of a baseline law.
    corners : whether the corners of a path of cells must be slow enough for ``a_lat_max``, rule ``curvature``
        (see :func:`corner_bounds`); not required of a baseline law or of the dissertation's.
    stops : whether the robot must stand at corners that its turning circle does not fit in, rule ``turn``;
        nothing is asked of the dissertation's law.
    curve : what the nodes lie on, if that is known. On one of poses a turn in place counts in ``s``.
    """
    if profile.law != "dissertation" and profile.law not in LAWS:
        return Violation("law", "profile", f"no rules are known here for a law called {profile.law!r}")
    placed = _places(profile, planned, scene, curve)
    if isinstance(placed, Violation):
        return placed
    if profile.law == "dissertation":
        if planned is None:
            return Violation("nodes", "profile", "the dissertation's law needs the path of cells")
        return check_dissertation(profile, planned, scene, v0)
    robot = scene.robot
    caps = [rule(profile, placed, scene, creep) for rule in LAWS[profile.law]]
    jerky = profile.law in JERKY
    if profile.xy is None and (corners or stops):
        bound, halt = corner_bounds(placed, scene)
        if corners and not jerky:
            caps.append(("curvature", bound))
        found = first(
            "turn",
            halt & (profile.v > 0.0) if stops else np.zeros(len(halt), dtype=np.bool_),
            lambda k: f"{float(profile.v[k])!r} m/s in a corner tighter than {robot.turn_radius:g} m",
        )
        if found is not None:
            return found
    # The caps are square roots of distances that were measured by other means.
    raised = [(name, cap * (1 + ROUNDING)) for name, cap in caps]
    found = check_motion(
        profile.s,
        profile.v,
        profile.a,
        profile.t,
        a_max=robot.a_max,
        d_max=robot.d_max,
        v_max=robot.v_max,
        caps=raised,
        v0=v0,
        jerk_max=None if jerky else robot.jerk_max,
    )
    if found is None and not jerky:
        found = _dawdling(profile, scene, creep * robot.v_max if slowest is None else slowest)
    return found


def clearance_bound(profile: Profile, places: Points, scene: Scene, creep: float) -> Bound:
    """What the walls allow at each node: the speed to stop before the nearest, or creep."""
    robot = scene.robot
    enough = (robot.radius + robot.v_max**2 / (2 * robot.d_max)) * (1 + ROUNDING)
    cells = np.rint(places)
    if (cells == places).all():
        x, y = cells.astype(np.int64).T
        away = wall_distance(scene.grid, x, y, enough)
    else:
        away = wall_distance_of_points(scene.grid, places, enough)
    room = np.maximum(away - robot.radius, 0.0)
    top = np.maximum(creep * robot.v_max, np.sqrt(2 * robot.d_max * room))
    return "clearance", np.where(np.isinf(away), np.inf, top)


def corner_bounds(places: Points, scene: Scene) -> tuple[Floats, NDArray[np.bool_]]:
    """What the corners of a path of cells allow: m/s at each node, and whether the robot must stand there.

    A corner may be rounded by an arc that begins and ends at most half the shorter of its two steps away from
    the node. On it the robot is no faster than at the faster of the nodes before, at and after the corner, so
    the bound ``sqrt(a_lat_max radius)`` is one of all three. Where the arc is tighter than the turning circle,
    or there is none because the path turns back, the robot stands; there the bound is silent.

    Parameters
    ----------
    places : cells, float64 (n, 2); the second node of a wait is where the first is.
    """
    robot, n = scene.robot, len(places)
    bound, halt = np.full(n, np.inf), np.zeros(n, dtype=np.bool_)
    fresh = [k for k in range(n) if k == 0 or (places[k] != places[k - 1]).any()]
    for before, at, after in zip(fresh, fresh[1:], fresh[2:], strict=False):
        (ax, ay), (bx, by) = (places[at] - places[before]).tolist(), (places[after] - places[at]).tolist()
        cross, dot = ax * by - ay * bx, ax * bx + ay * by
        if cross == 0.0 and dot > 0.0:
            continue
        turn = math.atan2(abs(cross), dot)
        half = 0.5 * min(math.hypot(ax, ay), math.hypot(bx, by)) * scene.grid.resolution
        radius = 0.0 if cross == 0.0 else half / math.tan(turn / 2)
        if radius <= 0.0 or radius < robot.turn_radius * (1 - ROUNDING):
            halt[at] = True
        elif radius >= robot.turn_radius * (1 + ROUNDING):
            top = math.sqrt(robot.a_lat_max * radius)
            for k in (before, at, after):
                bound[k] = min(bound[k], top)
    return bound, halt


LAWS: Mapping[str, tuple[LawCap, ...]] = MappingProxyType(
    {
        **dict.fromkeys(("physical", "uncertainty", "blind", "three-speed", "cloud"), (clearance_bound,)),
        "constant": (clearance_bound,),
        "optimum": (),
        "rpp": (),
    }
)
"""Laws in SI units that can be judged, and the caps that each promises.

All promise the robot's limits, but for jerk those of :data:`JERKY`.

To let another law be judged: one row here. To let another cap be judged: a function like
:func:`clearance_bound`, written from the cap's equation without looking at its code, that gives the bound at
the nodes; name it after the cap's cause. It may look at ``profile.s``, at the places and at the scene. A cap
that a setting turns off must not be listed, or must give infinity then: settings are not known here.
"""


JERKY = ("rpp",)
"""Baseline laws that know neither a limit on jerk nor our creep speed.

What of a limit they break, :mod:`lampyris.motion.laws.compare` tells.
"""


def wall_distance_of_points(grid: Grid, places: Points, beyond: float) -> Floats:
    """Metres from points (cells, (n, 2)) to the nearest wall's square; infinity if beyond ``beyond``.

    From coarse to fine: squares of 2^k cells that hold a wall are halved until they are single cells, and
    those that lie farther from a point than another one's farthest corner are dropped. So the work grows with
    the logarithm of ``beyond``, not with its square.
    """
    out = np.full(len(places), np.inf)
    reach = min(beyond / grid.resolution, float(grid.width + grid.height)) + 1.0
    for k in range(0, len(places), _TOGETHER):
        some = places[k : k + _TOGETHER]
        x0, y0 = (max(0, math.floor(v - reach)) for v in some.min(axis=0).tolist())
        x1, y1 = (max(0, math.ceil(v + reach) + 1) for v in some.max(axis=0).tolist())
        levels = _halved(grid.blocked[y0:y1, x0:x1], reach)
        out[k : k + _TOGETHER] = _nearest(levels, some - (x0, y0), reach) * grid.resolution
    return np.where(out <= beyond, out, np.inf)


def _halved(walls: BoolGrid, reach: float) -> list[BoolGrid]:
    """Whether squares of 2^k cells hold a wall, for k from 0 until a square is as wide as ``reach``."""
    levels = [walls]
    while min(reach, max(levels[-1].shape) * 2.0 ** (len(levels) - 1)) > 2.0 ** (len(levels) - 1):
        last = levels[-1]
        padded = np.zeros((-(-last.shape[0] // 2) * 2, -(-last.shape[1] // 2) * 2), dtype=np.bool_)
        padded[: last.shape[0], : last.shape[1]] = last
        levels.append(padded[0::2, 0::2] | padded[1::2, 0::2] | padded[0::2, 1::2] | padded[1::2, 1::2])
    return levels


def _nearest(levels: list[BoolGrid], places: Points, reach: float) -> Floats:
    """Cells from each place to the nearest wall; whatever is beyond ``reach`` may be infinity."""
    best = np.full(len(places), np.inf)
    size = 2.0 ** (len(levels) - 1)
    # At the coarsest level all squares within reach are among the three by three around the place.
    near = np.floor((places + 0.5) / size).astype(np.int64)
    near = np.clip(near, 0, np.array(levels[-1].shape[::-1]) - 1)
    who = np.repeat(np.arange(len(places)), 9)
    column = (near[:, :1] + np.tile((-1, 0, 1), 3)).ravel()
    row = (near[:, 1:] + np.repeat((-1, 0, 1), 3)).ravel()
    for k in range(len(levels) - 1, -1, -1):
        wall = levels[k]
        inside = (column >= 0) & (row >= 0) & (column < wall.shape[1]) & (row < wall.shape[0])
        inside[inside] = wall[row[inside], column[inside]]
        who, column, row = who[inside], column[inside], row[inside]
        if len(who) == 0:
            break
        half = 0.5 * 2.0**k
        gx = np.abs(2.0 * half * column + (half - 0.5) - places[who, 0])
        gy = np.abs(2.0 * half * row + (half - 0.5) - places[who, 1])
        least = np.hypot(np.maximum(gx - half, 0.0), np.maximum(gy - half, 0.0))
        if k == 0:
            np.minimum.at(best, who, least)
            break
        np.minimum.at(best, who, np.hypot(gx + half, gy + half))
        kept = (least <= best[who] + ROUNDING) & (least <= reach)
        who = np.repeat(who[kept], 4)
        column = (2 * column[kept, None] + (0, 1, 0, 1)).ravel()
        row = (2 * row[kept, None] + (0, 0, 1, 1)).ravel()
    return best


def _places(profile: Profile, planned: Path | None, scene: Scene, curve: Curve | None) -> Points | Violation:
    """Where the nodes are, cells; s must be the path's length to there."""
    if profile.xy is None:
        if planned is None:
            return Violation("nodes", "profile", "neither a path nor places of its nodes")
        return _places_of_cells(profile, planned, scene)
    xy, s = profile.xy, profile.s
    if planned is not None:
        for k in (0, -1):
            if np.abs(xy[k] - planned.cells[k]).max() > ROUNDING * max(1.0, float(np.abs(xy[k]).max())):
                at, cell = tuple(xy[k].tolist()), tuple(planned.cells[k].tolist())
                return Violation("nodes", f"node {k % len(xy)}", f"at {at}; the path has its end at {cell}")
    d = np.diff(xy, axis=0) * scene.grid.resolution
    chord = np.hypot(d[:, 0], d[:, 1])
    ds = np.diff(s)
    give = ROUNDING * (chord + float(np.abs(xy).max()) * scene.grid.resolution)
    # No path is shorter than the straight one, and an arc of half a turn is the longest between two nodes.
    bad = ~((ds >= chord - give) & (ds <= chord * (math.pi / 2) + give))
    if isinstance(curve, PoseCurve) and len(curve.lengths):
        ends = np.cumsum(curve.lengths)
        piece = np.minimum(np.searchsorted(ends, s[:-1] + 0.5 * ds, side="right"), len(ends) - 1)
        bad &= (curve.heading[piece] != 0.0).any(axis=1) | (chord > give)
    return (
        first("s", bad, lambda k: f"{float(ds[k])!r} m for nodes {float(chord[k])!r} m apart", "edge") or xy
    )


def _places_of_cells(profile: Profile, planned: Path, scene: Scene) -> Points | Violation:
    """The cell of each node; the second node of a wait has that of the first."""
    metric = profile.law != "dissertation"
    s = profile.s
    fresh = np.append(True, np.diff(s) != 0) if metric else np.ones(len(s), dtype=np.bool_)
    if int(fresh.sum()) != len(planned.cells):
        return Violation(
            "nodes", "profile", f"{int(fresh.sum())} places for a path of {len(planned.cells)} nodes"
        )
    d = np.diff(planned.cells.astype(np.int64), axis=0)
    scale = scene.grid.resolution if metric else 1.0
    want = np.append(0.0, np.cumsum(np.hypot(d[:, 0], d[:, 1]) * scale))
    node = np.cumsum(fresh) - 1
    bad = ~(np.abs(s - want[node]) <= ROUNDING * want[node])
    wrong = first(
        "s", bad, lambda k: f"s is {float(s[k])!r}, the path is {float(want[node[k]])!r} long there"
    )
    return wrong or planned.cells[node].astype(np.float64)


def _dawdling(profile: Profile, scene: Scene, slowest: float) -> Violation | None:
    """From rest to rest it may be slower for an obstacle's sake, but not slower than creeping."""
    robot, v = scene.robot, profile.v
    took, ds = np.diff(profile.t), np.diff(profile.s)
    slowest = min(robot.v_max, slowest)
    for k in np.flatnonzero((v[:-1] == 0) & (v[1:] == 0) & (ds > 0)).tolist():
        most = rest_to_rest(float(ds[k]), robot.a_max, robot.d_max, slowest)
        if robot.jerk_max is None and took[k] > most * (1 + ROUNDING) + 1e-12 * profile.t[-1]:
            return Violation(
                "time", f"edge {k}", f"{float(took[k])!r} s from rest to rest; creeping takes {most!r} s"
            )
    return None
