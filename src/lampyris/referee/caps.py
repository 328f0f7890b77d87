"""Caps of our law on a curve, measured again at the nodes and between them."""

from __future__ import annotations

import numpy as np

from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.referee.geometry.footprint import placed
from lampyris.referee.geometry.lines_and_arcs import segment_to_squares
from lampyris.referee.geometry.shapes import Ints
from lampyris.referee.profile import CREEP, ROUNDING, wall_distance_of_points
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats, Points

PARTS = 4
"""Places looked at on each edge, its first node among them."""


def check_caps(
    profile: Profile,
    curve: Curve,
    scene: Scene,
    *,
    creep: float = CREEP,
    curvature: bool = True,
    clearance: bool = True,
    zones: bool = True,
    parts: int = PARTS,
) -> Violation | None:
    """Whether a profile along a curve keeps the caps of bends, walls and zones, at nodes and between.

    Rules: ``nodes``, ``curvature``, ``clearance`` (on a curve of poses: of the footprint), ``yaw rate``, ``zone``. Between two
    nodes the speed is that of the
    profile's own constant acceleration; an edge from rest to rest is not looked at in between.

    Parameters
    ----------
    profile : in SI units, its distances those of the curve.
    curve, scene : judged against; moving obstacles are not known here.
    creep : share of v_max that no wall takes away.
    curvature, clearance, zones : whether the law promises the rule.
    parts : places looked at on each edge.
    """
    length = curve.length
    if abs(profile.s[-1] - length) > ROUNDING * max(1.0, length):
        return Violation("nodes", "profile", f"{float(profile.s[-1])!r} m long; the curve is {length!r} m")
    s, v = _fine(profile, parts)
    xy = curve.at(s)[0]
    robot = scene.robot
    found = None
    if curvature:
        most = np.sqrt(robot.a_lat_max / np.maximum(_bend(curve, s), 1e-300))
        found = _first("curvature", s, v, most, "the bend")
    if clearance and found is None:
        stop = robot.v_max**2 / (2 * robot.d_max)
        if isinstance(curve, PoseCurve) and robot.footprint is not None:
            # Nearer surfaces than it needs to stop are all that is of interest, and none at creep speed.
            needed = np.where(v <= creep * robot.v_max, 0.0, v**2 / (2 * robot.d_max))
            room = footprint_room(curve, s, xy, scene, needed)
        else:
            enough = (robot.radius + stop) * (1 + ROUNDING)
            room = np.maximum(wall_distance_of_points(scene.grid, xy, enough) - robot.radius, 0.0)
        most = np.maximum(creep * robot.v_max, np.sqrt(2 * robot.d_max * room))
        found = _first("clearance", s, v, most, "the nearest wall")
    if curvature and found is None and isinstance(curve, PoseCurve) and robot.yaw_rate_max is not None:
        turn = np.abs(curve.turn)[_inner_piece(curve, s)]
        found = _first("yaw rate", s, v, robot.yaw_rate_max / np.maximum(turn, 1e-300), "the turn")
    if zones and found is None and scene.zones is not None:
        found = _first("zone", s, v, _zone(scene, xy), "the zone")
    return found


def _fine(profile: Profile, parts: int) -> tuple[Floats, Floats]:
    """Distances and speeds at the nodes and between them."""
    s, v, ds = profile.s, profile.v, np.diff(profile.s)
    share = np.arange(parts) / parts
    along = ds[:, None] * share
    square = (v[:-1] ** 2)[:, None] + (np.diff(v**2))[:, None] * share
    fine_s = np.append((s[:-1, None] + along).ravel(), s[-1])
    return fine_s, np.sqrt(np.append(np.maximum(square, 0.0).ravel(), v[-1] ** 2))


def _bend(curve: Curve, s: Floats) -> Floats:
    """Curvature at each place, 1/m; 0 where it is within rounding of a border of two pieces."""
    if len(curve.lengths) == 0:
        return np.zeros(len(s))
    give = ROUNDING * max(1.0, curve.length)
    ends = np.cumsum(curve.lengths)
    begins = np.append(0.0, ends[:-1])
    piece = np.maximum(np.searchsorted(begins, s, side="right") - 1, 0)
    # What lies outside by rounding is not asked of; what lies inside is.
    inside = (s >= begins[piece] + give) & (s <= begins[piece] + curve.lengths[piece] - give)
    return np.where(inside, np.abs(curve.curvature)[piece], 0.0)


def _inner_piece(curve: PoseCurve, s: Floats) -> Ints:
    """The piece of each place; at a border, where two limits meet, the one that turns less."""
    ends = np.cumsum(curve.lengths)
    give = ROUNDING * max(1.0, curve.length)
    before, after = (np.searchsorted(ends, s + shift, side="right") for shift in (-give, give))
    last = len(ends) - 1
    before, after = np.minimum(before, last), np.minimum(after, last)
    turn = np.abs(curve.turn)
    return np.where(turn[before] < turn[after], before, after)


def footprint_room(curve: PoseCurve, s: Floats, xy: Points, scene: Scene, enough: Floats) -> Floats:
    """Metres from the footprint to the nearest blocked square at each place; infinity beyond ``enough`` metres, (n,).

    Every edge of the outline is measured against every blocked square within reach.
    """
    robot, grid = scene.robot, scene.grid
    outline, res = np.array(robot.footprint) / grid.resolution, grid.resolution
    arm = float(np.hypot(*outline.T).max())
    out = np.full(len(s), np.inf)
    most = float(enough.max(initial=0.0))
    away = wall_distance_of_points(grid, xy, (most + arm * res) * (1 + ROUNDING))
    yaws = curve.yaw_at(s)
    for i in np.flatnonzero((away <= enough + arm * res) & (enough > 0)).tolist():
        x, y = xy[i].tolist()
        corners = placed(outline, x, y, float(yaws[i]))
        # The nearest square is no farther from the footprint than from the base, which is in it.
        reach = min(float(enough[i]), float(away[i])) / res + 1.0
        x0, y0 = np.maximum(np.floor(corners.min(axis=0) - reach).astype(int), 0)
        x1, y1 = np.ceil(corners.max(axis=0) + reach).astype(int) + 1
        rows, columns = np.nonzero(grid.blocked[y0 : max(y1, 0), x0 : max(x1, 0)])
        if not len(rows):
            continue
        ends = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        least = min(float(segment_to_squares(a, b, columns + x0, rows + y0).min()) for a, b in ends) * res
        out[i] = least if least <= enough[i] else np.inf
    return out


def _zone(scene: Scene, xy: Points) -> Floats:
    """The speed limit of the cell that holds each place, m/s; infinity off the map."""
    assert scene.zones is not None
    x, y = np.floor(xy + 0.5).astype(np.int64).T
    grid = scene.grid
    on = (x >= 0) & (y >= 0) & (x < grid.width) & (y < grid.height)
    out = np.full(len(xy), np.inf)
    out[on] = scene.zones[y[on], x[on]]
    return out


def _first(rule: str, s: Floats, v: Floats, most: Floats, who: str) -> Violation | None:
    bad = ~(v <= most * (1 + ROUNDING))
    if not bad.any():
        return None
    k = int(bad.argmax())
    return Violation(rule, f"at {s[k]:g} m", f"{float(v[k])!r} m/s; {who} allows {float(most[k])!r}")
