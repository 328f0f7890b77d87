"""Profiles: whether the robot can drive these speeds, may drive them, and arrives when it is told to."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.referee.shapes import Ints, wall_distance
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

ROUNDING = 1e-9
"""Share of a bound that sums and square roots may be off by."""

CREEP = 0.1
"""Share of v_max that no clearance takes away, unless the law was told another."""

_TOP, _FLOOR, _BRAKE = 80.0, 20.0, 40.0
_RISE = np.array([20.0, 28.0, 44.0])
"""Rise of speed with a straight, a diagonal and a knight's step (Table 3.1; the last is lampyris' own)."""


def check_profile(
    profile: Profile, path: Path, scene: Scene, *, v0: float = 0.0, creep: float = CREEP
) -> Violation | None:
    """Whether a profile keeps its law at every node and between nodes.

    Rules: ``nodes``, ``law``, ``s``, ``speed``, ``start``, ``goal``, ``acceleration``, ``braking``, ``a``,
    ``time``; for the physical law also ``clearance``; for the dissertation's also ``angle`` and ``ring``.
    The first broken one is told, at its first node.

    Parameters
    ----------
    profile, path, scene : judged; the path is taken as checked. Moving obstacles are not known here: they
        only ever make a robot slower, so every bound asked for holds with them too.
    v0 : speed at the first node, in the law's units. The dissertation's law may lower it, the physical one
        must keep it.
    creep : for the physical law, share of v_max.
    """
    n = len(path.cells)
    sizes = {len(a) for a in (profile.s, profile.v, profile.a, profile.t, profile.cause)}
    if sizes != {n}:
        return Violation("nodes", "profile", f"{sorted(sizes)} values for a path of {n} nodes")
    if profile.law == "physical":
        return _physical(profile, path, scene, v0, creep)
    if profile.law == "dissertation":
        return _dissertation(profile, path, scene, v0)
    return Violation("law", "profile", f"no rules are known here for a law called {profile.law!r}")


def _first(
    rule: str, bad: NDArray[np.bool_], sentence: Callable[[int], str], noun: str = "node"
) -> Violation | None:
    """A violation at the first True, if there is one."""
    if not bad.any():
        return None
    k = int(bad.argmax())
    return Violation(rule, f"{noun} {k}", sentence(k))


def _lengths(path: Path) -> Floats:
    """Length of each step in cells."""
    d = np.diff(path.cells.astype(np.int64), axis=0)
    out: Floats = np.hypot(d[:, 0], d[:, 1])
    return out


def _distance(profile: Profile, ds: Floats) -> Violation | None:
    s = profile.s
    want = np.concatenate(([0.0], np.cumsum(ds)))
    bad = ~(np.abs(s - want) <= ROUNDING * want)
    return _first("s", bad, lambda k: f"s is {s[k]!r}, the path is {want[k]!r} long there")


def _ends(profile: Profile, limit: float) -> Violation | None:
    v = profile.v
    bad = ~((v >= 0) & (v <= limit * (1 + ROUNDING)))
    found = _first("speed", bad, lambda k: f"{v[k]!r} {profile.units}; allowed 0 to {limit:g}")
    if found is None and len(v) > 1 and v[-1] != 0:
        found = Violation("goal", f"node {len(v) - 1}", f"{v[-1]!r} {profile.units} at the goal; must be 0")
    return found


def _physical(profile: Profile, path: Path, scene: Scene, v0: float, creep: float) -> Violation | None:
    robot = scene.robot
    ds = _lengths(path) * scene.grid.resolution
    found = _distance(profile, ds) or _ends(profile, robot.v_max)
    if found is not None:
        return found
    v = profile.v
    if abs(v[0] - v0) > ROUNDING * v0:
        return Violation("start", "node 0", f"{v[0]!r} m/s at the start; the robot drives {v0!r} m/s there")
    x0, x1 = v[:-1] ** 2, v[1:] ** 2
    up, down = 2 * robot.a_max * ds, 2 * robot.d_max * ds
    give = ROUNDING * np.maximum(np.maximum(x0, x1), np.minimum(up, down))

    def needs(k: int) -> str:
        rate = (x1[k] - x0[k]) / (2 * ds[k])
        return f"from {v[k]!r} to {v[k + 1]!r} m/s in {ds[k]:g} m needs {rate!r} m/s2"

    return (
        _first(
            "acceleration", ~(x1 - x0 <= up + give), lambda k: f"{needs(k)}; a_max is {robot.a_max:g}", "edge"
        )
        or _first(
            "braking", ~(x0 - x1 <= down + give), lambda k: f"{needs(k)}; d_max is {robot.d_max:g}", "edge"
        )
        or _first(
            "a",
            ~(np.abs(2 * profile.a[:-1] * ds - (x1 - x0)) <= give),
            lambda k: f"a is {profile.a[k]!r}; {needs(k)}",
            "edge",
        )
        or _last_a(profile)
        or _clearance(profile, path, scene, v0, creep)
        or _times(profile, path, scene, ds, creep)
    )


def _last_a(profile: Profile) -> Violation | None:
    if profile.a[-1] != 0:
        return Violation(
            "a", f"node {len(profile.a) - 1}", f"a is {profile.a[-1]!r} where no step follows; must be 0"
        )
    return None


def _caps(path: Path, scene: Scene, creep: float) -> Floats:
    """What the walls allow at each node, m/s: speed to stop before the nearest, or creep."""
    robot = scene.robot
    enough = robot.radius + robot.v_max**2 / (2 * robot.d_max)
    x, y = path.cells[:, 0].astype(np.int64), path.cells[:, 1].astype(np.int64)
    room = np.maximum(wall_distance(scene.grid, x, y, enough * (1 + ROUNDING)) - robot.radius, 0.0)
    return np.minimum(robot.v_max, np.maximum(creep * robot.v_max, np.sqrt(2 * robot.d_max * room)))


def _clearance(profile: Profile, path: Path, scene: Scene, v0: float, creep: float) -> Violation | None:
    v = profile.v
    cap = _caps(path, scene, creep)
    bad = ~(v <= cap * (1 + ROUNDING))
    return _first("clearance", bad, lambda k: f"{v[k]!r} m/s; the nearest wall allows {cap[k]!r}")


def _times(profile: Profile, path: Path, scene: Scene, ds: Floats, creep: float) -> Violation | None:
    """Time strictly rises, and by what a constant acceleration between two nodes takes.

    From rest to rest no constant acceleration drives: there the robot speeds up, cruises at most at the cap,
    and brakes. It may be slower for an obstacle's sake, but never so slow as to creep below the creep speed.
    """
    t, v = profile.t, profile.v
    if t[0] != 0:
        return Violation("time", "node 0", f"t begins at {t[0]!r}; must be 0")
    dt = np.diff(t)
    found = _first("time", ~(dt > 0), lambda k: f"t goes from {t[k]!r} to {t[k + 1]!r}", "edge")
    if found is not None or len(dt) == 0:
        return found
    pace = v[:-1] + v[1:]
    rest = pace == 0
    least = 2 * ds / np.where(rest, 1.0, pace)
    most = least.copy()
    if rest.any():
        cap = _caps(path, scene, creep)
        for k in np.flatnonzero(rest).tolist():
            least[k] = _rest_to_rest(float(ds[k]), scene, float(min(cap[k], cap[k + 1])))
            most[k] = _rest_to_rest(float(ds[k]), scene, min(1.0, creep) * scene.robot.v_max)
    # Differences of a long time lose what the sum has rounded away.
    give = ROUNDING * most + 1e-12 * t[-1]
    bad = ~((dt >= least - give) & (dt <= most + give))
    return _first("time", bad, lambda k: f"{dt[k]!r} s for an edge that takes {least[k]!r} s", "edge")


def _rest_to_rest(ds: float, scene: Scene, cap: float) -> float:
    """Seconds from rest to rest: full acceleration, a cruise at the cap if it is reached, full braking."""
    a, d = scene.robot.a_max, scene.robot.d_max
    to_cap, from_cap = cap * cap / (2 * a), cap * cap / (2 * d)
    if to_cap + from_cap <= ds:
        return cap / a + cap / d + (ds - to_cap - from_cap) / cap
    peak = math.sqrt(2 * ds * a * d / (a + d))
    return peak / a + peak / d


def _dissertation(profile: Profile, path: Path, scene: Scene, v0: float) -> Violation | None:
    """The law of method.md section 6, in velocity units and transfers."""
    found = _distance(profile, _lengths(path)) or _ends(profile, _TOP)
    if found is not None:
        return found
    v = profile.v
    if v[0] > v0 * (1 + ROUNDING):
        return Violation("start", "node 0", f"{v[0]!r} at the start; the robot drives {v0!r} there")
    give = ROUNDING * _TOP
    cells = path.cells.astype(np.int64)
    d = cells[1:] - cells[:-1]
    rise = _RISE[np.minimum(np.abs(d[:, 0] * d[:, 1]), 2)]
    dv = np.diff(v)
    angle, ring = _angle_caps(d), _ring_caps(path, scene, d)
    inner = v[1:-1]
    count = np.arange(len(v), dtype=np.float64)
    return (
        _first(
            "acceleration", ~(dv <= rise + give), lambda k: f"rises by {dv[k]!r}; {rise[k]:g} at most", "edge"
        )
        or _first(
            "braking", ~(-dv <= _BRAKE + give), lambda k: f"falls by {-dv[k]!r}; {_BRAKE:g} at most", "edge"
        )
        or _first(
            "angle", _shift(~(inner <= angle + give)), lambda k: f"{v[k]!r}; the bend allows {angle[k - 1]:g}"
        )
        or _first(
            "ring", _shift(~(inner <= ring + give)), lambda k: f"{v[k]!r}; the walls allow {ring[k - 1]:g}"
        )
        or _first(
            "a",
            ~(np.abs(profile.a[:-1] - dv) <= give),
            lambda k: f"a is {profile.a[k]!r}, v changes by {dv[k]!r}",
        )
        or _last_a(profile)
        or _first("time", ~(profile.t == count), lambda k: f"t is {profile.t[k]!r} after {k} transfers")
    )


def _shift(inner: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What is said of inner nodes, at their own numbers."""
    return np.concatenate((np.zeros(1, dtype=np.bool_), inner))


def _angle_caps(d: Ints) -> Floats:
    """80, 60 or 20 at each inner node by the turn there: below 22.5 degrees, below 67.5, or sharper."""
    came, goes = d[:-1], d[1:]
    dot = (came * goes).sum(axis=1)
    cross = np.abs(came[:, 0] * goes[:, 1] - came[:, 1] * goes[:, 0])
    gentle = (dot > 0) & (cross < dot * math.tan(math.pi / 8))
    bend = (dot > 0) & (cross < dot * math.tan(3 * math.pi / 8))
    return np.where(gentle, 80.0, np.where(bend, 60.0, 20.0))


def _ring_caps(path: Path, scene: Scene, d: Ints) -> Floats:
    """``80 - 6 n1 - 3 n2``, not below 20, at each inner node, counting walls alone.

    n1: the eight neighbours that are blocked or off the map. n2: cells two away, within 45 degrees of the
    step that led here, that are blocked; there the outside of the map does not count.
    """
    grid = scene.grid
    # Two cells of frame: read without bounds; one copy says what is off the map.
    off = np.pad(np.zeros_like(grid.blocked), 2, constant_values=True)
    wall = np.pad(grid.blocked, 2, constant_values=False)
    inner = path.cells[1:-1].astype(np.int64) + 2
    x, y = inner[:, 0], inner[:, 1]
    hx, hy = d[:-1, 0], d[:-1, 1]
    n1 = np.zeros(len(inner), dtype=np.int64)
    n2 = np.zeros(len(inner), dtype=np.int64)
    for oy in range(-2, 3):
        for ox in range(-2, 3):
            away = max(abs(ox), abs(oy))
            if away == 1:
                n1 += wall[y + oy, x + ox] | off[y + oy, x + ox]
            elif away == 2:
                along, across = ox * hx + oy * hy, np.abs(ox * hy - oy * hx)
                n2 += wall[y + oy, x + ox] & (along > 0) & (across <= along)
    return np.maximum(_FLOOR, _TOP - 6.0 * n1 - 3.0 * n2)
