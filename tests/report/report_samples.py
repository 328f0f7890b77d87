"""Plans, profiles and traces made by hand from the nouns, to be drawn and written."""

from __future__ import annotations

from collections import deque

import numpy as np

from lampyris.model.field import Field, Gate
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.plan import Candidate, Jump, Plan, Status
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.model.trace import Event, Outcome, Trace
from lampyris.model.traffic import Obstacle

FOUR = MOVES["four-connected"]


def sample_scene(width: int = 12, height: int = 9, resolution: float = 0.5, unknown: bool = True) -> Scene:
    """A hall with a wall in the middle and a corner nobody has seen."""
    blocked = np.zeros((height, width), dtype=bool)
    blocked[: height - 2, width // 2] = True
    lost = np.zeros_like(blocked)
    lost[:2, width - 2 :] = unknown
    grid = Grid(blocked | lost, lost if unknown else None, resolution, (1.0, 2.0, 0.0), "hall")
    return Scene(grid, (1, 1), (width - 3, 2), FOUR)


def sample_field(scene: Scene) -> Field:
    """Distances to the goal by breadth-first search; luciferin like the cost."""
    h, w = scene.grid.blocked.shape
    exact = np.full((h, w), -1, dtype=np.int64)
    step = np.full((h, w), -1, dtype=np.int8)
    exact[scene.goal[1], scene.goal[0]] = 0
    queue = deque([scene.goal])
    while queue:
        x, y = queue.popleft()
        for k, (dx, dy) in enumerate(FOUR.offsets):
            u, v = x - dx, y - dy
            if 0 <= u < w and 0 <= v < h and not scene.grid.blocked[v, u] and exact[v, u] < 0:
                exact[v, u] = exact[y, x] + 1
                step[v, u] = k
                queue.append((u, v))
    luciferin = np.where(exact < 0, np.inf, exact * 1.5)
    return Field(~scene.grid.blocked, exact, step, luciferin, scene.goal, FOUR)


def sample_plan(scene: Scene) -> Plan:
    """Down the parents, told as jumps of four steps, with a gate of each sort."""
    field = sample_field(scene)
    cells = [scene.start]
    while cells[-1] != scene.goal:
        x, y = cells[-1]
        dx, dy = FOUR.offsets[field.step[y, x]]
        cells.append((x + dx, y + dy))
    jumps = []
    for k in range(0, len(cells) - 1, 4):
        way = tuple(cells[k : k + 5])
        others = (Candidate((0, 0), 2, 3.25, 0.25), Candidate(way[-1], 1, 1.5, 0.75))
        jumps.append(Jump(way[0], 6.0, others, way[-1], way, k == 0, 3))
    path = path_of(np.array(cells), FOUR)
    gates = (Gate(cells[3], "x", 0.5, False), Gate((0, 8), "y", 0.5, True), Gate((0, 5), "xy", 0.5, False))
    return Plan(
        Status.FOUND,
        "by-hand",
        path,
        len(jumps),
        99,
        jumps=tuple(jumps),
        optimal_exact=path.exact,
        gates_on_path=gates[:1],
        gates_in_map=gates,
    )


def sample_profile(plan: Plan, law: str = "physical") -> Profile:
    """Up, along and down again."""
    assert plan.path is not None
    n = len(plan.path.cells)
    v = np.minimum(np.minimum(np.arange(n), np.arange(n)[::-1]), 3) / 3.0
    cause = (
        "start",
        *("acceleration", "limit", "clearance", "a new cap")[: n - 2],
        *("limit",) * (n - 6),
        "goal",
    )
    s = plan.path.arc * 0.5
    a = np.append(np.diff(v**2) / (2 * np.diff(s)), 0.0)
    t = np.append(0.0, np.cumsum(2 * np.diff(s) / (v[1:] + v[:-1])))
    return Profile(law, s, v, a, t, cause, "m/s" if law == "physical" else "velocity units")


def sample_trace(outcome: Outcome = Outcome.ARRIVED, ticks: int | None = None) -> Trace:
    """A drive along the sample plan with one wait, and an obstacle of each kind, one of them wide."""
    scene = sample_scene()
    cells = sample_plan(scene).path.cells.tolist()
    robot = [*cells[:4], cells[3], *cells[4:]]
    robot = robot if ticks is None else [*robot, *[robot[-1]] * ticks][: ticks + 1]
    n = len(robot)
    kinds = ("random-walk", "patrol", "crossing", "recorded", "unheard of")
    tracks, appears = [], []
    for k in range(len(kinds)):
        t0 = 0 if k < 3 else 2
        tracks.append(np.array([[7 + k % 4, 3 + (t + k) % 4] for t in range(t0, n)]))
        appears.append(t0)
    bodies = tuple(Obstacle(kind, 0.6 if kind == "crossing" else 0.0, kind == "patrol") for kind in kinds)
    events = (
        Event(0, "replan", scene.start),
        Event(4, "wait", scene.start),
        Event(n - 1, "arrive", scene.goal),
    )
    return Trace(
        scene, "by-hand", 3, outcome, np.array(robot), tuple(tracks), tuple(appears), bodies,
        np.linspace(0, 1, n), ("limit",) * n, "physical", "m/s", events, 1, 1, 1, 9,
        path_of(np.array(cells), FOUR),
    )  # fmt: skip
