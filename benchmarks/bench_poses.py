"""The planner pad compared with the planner lattice at the same bound: states expanded, and processor time."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, judge
from benchmarks.maps import published_map, rooms

from lampyris.kernels._jit import compiled_only
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.planning.lattice.pad.pad_planner import PadPlanner
from lampyris.planning.lattice.primitives import angles
from lampyris.planning.lattice.search import LatticeSearch
from lampyris.referee import check_plan

TITLE = "Poses"
HOW = """The planner `pad` compared with `lattice` at the same `weight`, from the same poses, cells of 0.125 m: states that each
expands (cells and poses of all rounds and phases of `pad`; a round's shares are in `Plan.rounds`), and milliseconds of this
thread's processor time for a call on an open session, the heuristic of the goal included for both. `lattice` settles an
octile field of the whole map (about 10 ns a cell), `pad` the projected graph as far as the start (`settled`); neither is
among the expansions. `lattice` is without its first try and without shortcuts. *motions*: of the path of `pad`. A search that
comes to a path state by state expands no fewer states than the path has motions: where these are more than a fifth of what
`lattice` expands, no search can have a fifth. Random pairs of poses that a path joins; each answer is checked by the
referee, and each cost against the other's bound. The tables of open space, once for a robot, are made before."""

RESOLUTION = 0.125
WEIGHTS = (1.09, 1.2, 1.6)
ASKED = 5.0
"""How many times fewer states pad shall expand."""
MAPS = ("arena2", "Berlin_0_256", "AR0011SR", "ht_0_hightown", "16room_000", "maze512-32-0", "random512-10-0")
ROBOTS = {
    "1.2 x 0.5 m, ackermann": Robot(
        footprint=((0.6, 0.25), (-0.6, 0.25), (-0.6, -0.25), (0.6, -0.25)),
        drive="ackermann",
        turn_radius=1.25,
    ),
    "0.9 x 0.62 m, differential": Robot(
        footprint=((0.45, 0.31), (-0.45, 0.31), (-0.45, -0.31), (0.45, -0.31)), drive="differential"
    ),
    "disc of 0.3 m, omnidirectional": Robot(radius=0.3, drive="omnidirectional"),
}


@dataclass(frozen=True, slots=True)
class Pair:
    """What both planners took for one pair of poses."""

    lattice: int
    low: int
    high: int
    tracking: int
    motions: int
    settled: int
    lattice_ms: float
    pad_ms: float
    rounds: int

    @property
    def share(self) -> float:
        """States that pad expanded, of those of lattice."""
        return (self.low + self.high + self.tracking) / max(self.lattice, 1)

    @property
    def least(self) -> float:
        """Motions of the path, of the states that lattice expanded: a search cannot have a lesser share."""
        return self.motions / max(self.lattice, 1)


def grids(quick: bool) -> Iterator[tuple[str, Grid]]:
    """The maps at hand."""
    for name in MAPS[:1] if quick else MAPS:
        free = published_map(name)
        if free is not None:
            yield name, Grid(~free, resolution=RESOLUTION)
    # Rooms of 3.75 m, with doors of a cell made wide enough by halving the resolution twice.
    walls = np.kron(~rooms(128, 31), np.ones((4, 4), dtype=bool))
    yield "rooms", Grid(walls, resolution=RESOLUTION * 2)


def timed(session: object, scene: Scene) -> tuple[Plan, float]:
    begin = time.thread_time_ns()
    plan: Plan = session.plan()  # type: ignore[attr-defined]
    spent = (time.thread_time_ns() - begin) / 1e6
    assert not plan or check_plan(plan, scene) is None
    return plan, spent


def pairs(grid: Grid, robot: Robot, count: int) -> list[Scene]:
    """Scenes with random free poses that a path joins."""
    rng = np.random.default_rng([grid.width, int(grid.blocked.sum())])
    ys, xs = np.nonzero(~grid.blocked)
    corner = (*grid.to_metres((int(xs[0]), int(ys[0]))).tolist(), 0.0)
    session = LatticePlanner().open(Scene(grid, start_pose=corner, goal_pose=corner, robot=robot), rng)
    free = session._search_among(frozenset()).lattice_map

    def pose() -> tuple[float, float, float]:
        while True:
            k, heading = int(rng.integers(len(xs))), int(rng.integers(16))
            cell = (int(xs[k]), int(ys[k]))
            if free.is_free(cell, heading):
                x, y = grid.to_metres(cell).tolist()
                return x, y, math.remainder(angles(16)[heading], 2 * math.pi)

    found: list[Scene] = []
    tries = 0
    while len(found) < count and tries < 20 * count:
        scene = Scene(grid, start_pose=pose(), goal_pose=pose(), robot=robot)
        tries += 1
        if PadPlanner(weight=3.0).open(scene, rng).plan():
            found.append(scene)
    return found


def compared(scene: Scene, weight: float) -> Pair:
    """Both planners on one scene, each on a session whose map is made."""
    rng = np.random.default_rng(0)
    full, adaptive = (
        LatticePlanner(weight=weight, shortcut=False).open(scene, rng),
        PadPlanner(weight=weight, shortcut=False).open(scene, rng),
    )
    for session in (full, adaptive):
        session._search = session._search_among(frozenset())
    full._search = LatticeSearch(full.lattice_map)  # without a first try
    theirs, their_ms = timed(full, scene)
    ours, our_ms = timed(adaptive, scene)
    a, b = ours.pose_path, theirs.pose_path
    assert a is not None
    assert b is not None
    assert a.bound <= weight * (1 + 1e-9)
    assert max(a.lower_bound_m, b.lower_bound_m) <= min(a.cost_m, b.cost_m) * (1 + 1e-9)
    low, high, tracking = (
        sum(getattr(one, f"{what}_expansions") for one in ours.rounds) for what in ("low", "high", "tracking")
    )
    found = next((one.tracked for one in reversed(ours.rounds) if one.tracked), ours.rounds[-1].planned)
    return Pair(
        theirs.expansions, low, high, tracking, len(found) - 1, adaptive.settled, their_ms, our_ms, len(ours.rounds)
    )  # fmt: skip


def bench(quick: bool) -> Section:
    """All robots on all maps at all weights."""
    count = 3 if quick else 10
    rows, figures = [], []
    shares: dict[tuple[str, float], list[float]] = {}
    least: dict[tuple[str, float], list[float]] = {}
    with compiled_only():
        for who, robot in ROBOTS.items():
            for name, grid in grids(quick):
                scenes = pairs(grid, robot, count)
                for weight in WEIGHTS if scenes else ():
                    got = [compared(scene, weight) for scene in scenes]
                    shares.setdefault((who, weight), []).append(statistics.median(one.share for one in got))
                    least.setdefault((who, weight), []).append(statistics.median(one.least for one in got))
                    middle = [
                        statistics.median(getattr(one, what) for one in got)
                        for what in (
                            "lattice",
                            "low",
                            "high",
                            "tracking",
                            "motions",
                            "share",
                            "settled",
                            "lattice_ms",
                            "pad_ms",
                            "rounds",
                        )
                    ]
                    rows.append((
                        who, name, f"{weight:g}", *(f"{value:.0f}" for value in middle[:5]), f"{middle[5]:.3f}",
                        f"{middle[6]:.0f}", *(f"{value:.1f}" for value in middle[7:9]), f"{middle[9]:.0f}",
                    ))  # fmt: skip
                    print(rows[-1], flush=True)
    heads = (
        "robot", "map", "weight", "lattice", "pad: cells", "poses", "tracking", "motions", "share",
        "settled", "lattice ms", "pad ms", "rounds",
    )  # fmt: skip
    for (who, weight), of in shares.items():
        inverse = Spread.of([1 / share for share in of])
        figures.append(
            Figure(
                f"{who}, weight {weight:g}",
                "times fewer",
                inverse,
                "lattice",
                Spread.of([1.0]),
                True,
                asked=ASKED,
                note=f"the motions of the path alone: {statistics.median(1 / one for one in least[who, weight]):.2f} times fewer",
            )
        )
    limited = [
        f"{who}, weight {weight:g}"
        for (who, weight), of in least.items()
        if statistics.median(1 / one for one in of) < ASKED
    ]
    within = [one for one in figures if one.task not in limited]
    verdicts = [judge("States that pad expands, of those of lattice, in the median of the maps", figures)]
    if limited and within:
        verdicts.append(
            judge(f"The same without {'; '.join(limited)}, where the path alone has too many motions", within)
        )
    return Section(
        "poses", TITLE, HOW, (Table(heads, tuple(rows), "Medians of the pairs of each map"),), tuple(figures),
        tuple(verdicts),
        versions(("numpy", "numba")),
    )  # fmt: skip
