"""Beside TOPP-RA on random smooth paths with the same limits: our own result is the time optimum.

Like with like. A path is a cubic spline through random points of the plane. Both get the same grid of nodes
on it, a top speed, a lateral limit as a speed at each node, ``sqrt(a_lat_max / curvature)``, and unequal limits
on the acceleration along the path. TOPP-RA gets them in two ways:

* along: its path is the distance itself, q(s) = s, so that its joint's limits are the robot's. Both then
  solve the same discrete problem and only rounding is between them. TOPP-RA gives away up to 1e-8 of x = v^2
  (1e-4 of x where x is small) at each step of its forward pass, and its linear programs are solved to about
  1e-7.
* plane: its path is the spline over its own parameter u, and the acceleration along the path is ``|q'| u'' +
  (q' q'' / |q'|) u'^2``, bounded at each node and its right neighbour (its ``Interpolation`` scheme). There
  TOPP-RA takes the acceleration over u as constant on an edge, not that over the distance; its time comes
  down to ours as the grid is refined, by half with each doubling.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from lampyris.motion.profile import Feasible, feasible_profile
from sizes import sized

pytestmark = pytest.mark.nightly
toppra = pytest.importorskip("toppra")
algorithm = pytest.importorskip("toppra.algorithm")
constraint = pytest.importorskip("toppra.constraint")

ALONG, PLANE = 200, 1200
"""Edges of the two grids."""


class Smooth(NamedTuple):
    """A spline on a grid of its parameter, and what the robot may do on it."""

    spline: Any
    grid: Any
    s: Any
    cap: Any
    a_max: float
    d_max: float


def smooth_path(rng: np.random.Generator, nodes: int) -> Smooth:
    """A spline through 4 to 8 random points without cusps; distance by Gauss's rule on each edge."""
    points = np.cumsum(rng.normal((1.5, 0.0), 0.7, (int(rng.integers(4, 9)), 2)), axis=0)
    spline = toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(points)), points)
    grid = np.linspace(0.0, 1.0, nodes + 1)
    x, w = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(grid)
    u = (grid[:-1] + half)[:, None] + half[:, None] * x
    pace = np.hypot(*spline(u.ravel(), 1).T).reshape(u.shape)
    s = np.concatenate(([0.0], np.cumsum(half * (pace @ w))))
    (dx, dy), (ddx, ddy) = spline(grid, 1).T, spline(grid, 2).T
    curvature = np.abs(dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3
    top, lateral, a, d = (float(v) for v in 10.0 ** rng.uniform(-0.7, 0.7, 4))
    cap = np.minimum(top, np.sqrt(lateral / np.maximum(curvature, 1e-12)))
    return Smooth(spline, grid, s, cap, a, d)


def ours(path: Smooth) -> Feasible:
    return feasible_profile(path.s, [("curvature", path.cap)], a_max=path.a_max, d_max=path.d_max)


def along(path: Smooth) -> tuple[Any, Any]:
    """Speeds by TOPP-RA on the line q(s) = s, and their times."""
    line = toppra.SimplePath(path.s[[0, -1]], path.s[[0, -1], None], np.ones((2, 1)))
    at = dict(zip(path.s.tolist(), path.cap.tolist(), strict=True))
    limits = [
        constraint.JointVelocityConstraintVarying(lambda s: np.array([[-at[float(s)], at[float(s)]]])),
        constraint.JointAccelerationConstraint(np.array([[-path.d_max, path.a_max]])),
    ]
    solver = algorithm.TOPPRA(limits, line, gridpoints=path.s, solver_wrapper="seidel")
    _, v, _ = solver.compute_parameterization(0.0, 0.0)
    return v, np.concatenate(([0.0], np.cumsum(2 * np.diff(path.s) / (v[:-1] + v[1:]))))


class Tangential(constraint.LinearConstraint):  # type: ignore[misc,name-defined]
    """Bounds on the acceleration along the path, and on its speed, over the spline's own parameter."""

    def __init__(self, path: Smooth) -> None:
        super().__init__()
        self.path = path
        self.dof = 2
        self.identical = False

    def compute_constraint_params(self, path: Any, grid: Any) -> Any:
        d1, d2 = path(grid, 1), path(grid, 2)
        pace = np.hypot(*d1.T)
        a, b, c = pace[:, None], ((d1 * d2).sum(axis=1) / pace)[:, None], np.zeros((len(grid), 1))
        f = np.tile(np.array([[1.0], [-1.0]]), (len(grid), 1, 1))
        g = np.tile(np.array([self.path.a_max, self.path.d_max]), (len(grid), 1))
        bound = np.stack((np.zeros(len(grid)), (self.path.cap / pace) ** 2), axis=1)
        made = constraint.linear_constraint.canlinear_colloc_to_interpolate(a, b, c, f, g, None, None, grid)
        return (*made[:5], None, bound)


def plane(path: Smooth) -> float:
    """Time by TOPP-RA on the spline itself."""
    solver = algorithm.TOPPRA([Tangential(path)], path.spline, gridpoints=path.grid, solver_wrapper="seidel")
    _, rate, _ = solver.compute_parameterization(0.0, 0.0)
    return float((2 * np.diff(path.grid) / (rate[:-1] + rate[1:])).sum())


@pytest.mark.nightly
@sized("cases", 50, 200)
def test_on_the_distance_the_speeds_are_toppras(cases: int) -> None:
    rng = np.random.default_rng(1)
    off = []
    for _ in range(cases):
        path = smooth_path(rng, ALONG)
        made, (v, t) = ours(path), along(path)
        x, theirs = made.v**2, v**2
        assert (theirs <= x * (1 + 1e-6)).all()
        assert (theirs >= x * (1 - 1e-3) - 1e-8 * len(x)).all()
        off.append(float(made.t[-1] / t[-1]) - 1)
    print(f"\nalong: our time is TOPP-RA's {min(off):+.1e} to {max(off):+.1e} of it", end="")
    assert min(off) >= -1e-5
    assert max(off) <= 1e-6


@pytest.mark.nightly
@sized("cases", 25, 200)
def test_on_the_plane_the_times_are_toppras_within_a_hundredth(cases: int) -> None:
    rng = np.random.default_rng(2)
    off = []
    for _ in range(cases):
        path = smooth_path(rng, PLANE)
        off.append(float(ours(path).t[-1]) / plane(path) - 1)
    print(f"\nplane: our time is TOPP-RA's {min(off):+.2%} to {max(off):+.3%}", end="")
    assert min(off) >= -0.01
    assert max(off) <= 1e-3


@pytest.mark.nightly
def test_where_toppra_is_slower_it_is_its_grid() -> None:
    off = []
    for seed in range(12):
        grids = [smooth_path(np.random.default_rng(seed), edges) for edges in (150, 300, 600)]
        times = [plane(path) for path in grids]
        off.append([time / float(ours(grids[-1]).t[-1]) - 1 for time in times])
    gap = np.array(off).mean(axis=0)
    assert (gap[1:] < 0.65 * gap[:-1]).all()
    assert gap[-1] > 0.0
