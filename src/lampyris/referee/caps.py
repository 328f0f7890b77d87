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
from lampyris.typing import BoolGrid, Floats, Points

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
            room = footprint_room(curve.yaw_at(s), xy, scene, needed)
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


def footprint_room(yaws: Floats, xy: Points, scene: Scene, enough: Floats) -> Floats:
    """Metres from the footprint to the nearest blocked square at each place; infinity beyond ``enough`` metres, (n,).

    Parameters
    ----------
    yaws : float64 (n,), radians counterclockwise from the rows of the map.
    xy : float64 (n, 2), cells.

    Every edge of the outline is measured against every blocked square that can be the nearest. The base is in the footprint,
    so that such a square is no farther from the base than its nearest square and the farthest vertex together. Squares with
    blocked ones on all four sides are left out: a footprint with its base outside reaches others first.
    """
    robot, grid = scene.robot, scene.grid
    outline, res = np.array(robot.footprint) / grid.resolution, grid.resolution
    arm = float(np.hypot(*outline.T).max())
    out = np.full(len(xy), np.inf)
    most = float(enough.max(initial=0.0))
    away = wall_distance_of_points(grid, xy, (most + arm * res) * (1 + ROUNDING))
    near = np.flatnonzero((away <= enough + arm * res) & (enough > 0))
    rim = _rim(grid.blocked)
    reach = np.minimum(enough, away) / res + arm + 1e-6
    for first in range(0, len(near), _TOGETHER):
        some = near[first : first + _TOGETHER]
        who, x, y = _squares_about(rim, xy[some], reach[some])
        corners = np.array(
            [placed(outline, float(xy[i, 0]), float(xy[i, 1]), float(yaws[i])) for i in some.tolist()]
        )
        least = np.full(len(some), np.inf)
        for a, b in zip(corners.swapaxes(0, 1), np.roll(corners, -1, axis=1).swapaxes(0, 1), strict=True):
            np.minimum.at(least, who, segment_to_squares(a[who], b[who], x, y))
        least *= res
        least[away[some] == 0.0] = 0.0
        out[some] = np.where(least <= enough[some], least, np.inf)
    return out


_TOGETHER = 512
"""Places whose squares are measured at once."""


def _rim(blocked: BoolGrid) -> BoolGrid:
    """Blocked cells that are not surrounded by blocked cells on all four sides."""
    padded = np.pad(blocked, 1)
    return blocked & ~(padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:])


def _squares_about(rim: BoolGrid, xy: Points, reach: Floats) -> tuple[Ints, Ints, Ints]:
    """Cells of ``rim`` whose squares are within reach (cells) of each place: number of the place, x and y."""
    who, xs, ys = [], [], []
    low = np.maximum(np.floor(xy - reach[:, None]).astype(int), 0)
    high = np.ceil(xy + reach[:, None]).astype(int) + 1
    for k, ((x0, y0), (x1, y1)) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        rows, columns = np.nonzero(rim[y0 : max(y1, 0), x0 : max(x1, 0)])
        dx = np.maximum(np.abs(columns + (x0 - xy[k, 0])) - 0.5, 0.0)
        dy = np.maximum(np.abs(rows + (y0 - xy[k, 1])) - 0.5, 0.0)
        kept = dx * dx + dy * dy <= reach[k] * reach[k]
        who.append(np.full(np.count_nonzero(kept), k))
        xs.append(columns[kept] + x0)
        ys.append(rows[kept] + y0)
    return np.concatenate(who), np.concatenate(xs), np.concatenate(ys)


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
