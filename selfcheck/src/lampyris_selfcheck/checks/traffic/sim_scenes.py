"""Drawn simulations: small maps with traffic of every kind, walls that come and go, drives at their worst."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from lampyris.errors import SceneError
from lampyris.io.maps.library import load
from lampyris.model.drive import Drive
from lampyris.model.edit import Edit
from lampyris.model.grid import Grid
from lampyris.model.moves import moves_named
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, ObstacleSpec, Patrol, RandomWalk, Recorded
from lampyris.motion.laws.registry import LAWS
from lampyris.planning import registry
from lampyris.planning.base import Planner
from lampyris.planning.field.solve import solve
from lampyris.sim.continuous.drive import drive
from lampyris.sim.traffic.adversary import Adversary
from lampyris.typing import BoolGrid, Cell

KINDS = ("random-walk", "rate", "patrol", "crossing", "recorded", "all")
MOVES = ("octile", "octile", "dissertation", "four-connected", "sixteen-connected")
SIZES = ((0.0, 0.0), (0.0, 0.0), (0.0, 1.0), (0.8, 0.0), (0.8, 1.2))
"""Radii of the robot and of bodies, metres."""

REFUSED = frozenset(("OBSTACLE_TRACK", "OBSTACLE_OVERLAP", "OBSTACLE_START", "OBSTACLE_ROOM"))
"""Drawn traffic that does not fit the map; no other reason to refuse a drawn scene is a right one."""

PROMISE = tuple(sorted(set(LAWS) - {"dissertation", "rpp", "constant", "optimum"}))
"""Laws that say they collide with nobody."""


@lru_cache(maxsize=32)
def planner(name: str) -> Planner:
    """A planner with its defaults."""
    return registry.make(name, {})


def random_track(rng: np.random.Generator, blocked: BoolGrid, length: int) -> tuple[Cell, ...]:
    """A walk that keeps out of walls."""
    height, width = blocked.shape
    ys, xs = np.nonzero(~blocked)
    pick = int(rng.integers(len(xs)))
    track = [(int(xs[pick]), int(ys[pick]))]
    while len(track) < length:
        x, y = track[-1]
        steps = [(x + dx, y + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
        steps = [c for c in steps if 0 <= c[0] < width and 0 <= c[1] < height and not blocked[c[1], c[0]]]
        track.append(steps[int(rng.integers(len(steps)))])
    return tuple(track)


def drawn_scene(
    rng: np.random.Generator,
    kind: str,
    robot_radius: float = 0.0,
    body_radius: float = 0.0,
    moves: str = "octile",
) -> Scene:
    """A random map of 12 to 23 cells a side with its ends free, and traffic of one kind."""
    width, height = (int(v) for v in rng.integers(12, 24, 2))
    sized = robot_radius > 0 or body_radius > 0
    blocked = rng.random((height, width)) < (0.03 if sized else rng.choice((0.0, 0.1, 0.25)))
    start, goal = (1, 1), (width - 2, height - 2)
    for x, y in (start, goal):
        blocked[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3] = False
    free = [(int(x), int(y)) for y, x in zip(*np.nonzero(~blocked), strict=True)]
    count = 3 if sized else int(rng.integers(3, 14))
    traffic: list[ObstacleSpec] = []
    if kind in ("random-walk", "all"):
        traffic.append(RandomWalk(count, radius=body_radius))
    if kind in ("rate", "all"):
        traffic.append(RandomWalk(count, rate=0.5, radius=body_radius))
    if kind in ("crossing", "all"):
        traffic.append(Crossing(1 if kind == "all" else min(count, 5), radius=body_radius))
    if kind in ("patrol", "all"):
        for _ in range(1 if kind == "all" else 3):
            way = tuple(free[k] for k in rng.integers(0, len(free), 3).tolist())
            traffic.append(Patrol(way, radius=body_radius))
    if kind in ("recorded", "all"):
        traffic += [Recorded(random_track(rng, blocked, 25), radius=body_radius) for _ in range(2)]
    return Scene(Grid(blocked), start, goal, moves_named(moves), Robot(radius=robot_radius), tuple(traffic))


def crowded(rng: np.random.Generator) -> Scene:
    """A map of 5 to 13 cells a side, and walkers on up to a third of its cells; the ends far apart."""
    moves = moves_named(("octile", "octile", "dissertation", "four-connected")[int(rng.integers(4))])
    while True:
        width, height = (int(n) for n in rng.integers(5, 14, 2))
        blocked = rng.random((height, width)) < rng.uniform(0.0, 0.2)
        free = [(int(x), int(y)) for y, x in zip(*np.nonzero(~blocked), strict=True)]
        start, *some = (free[k] for k in rng.choice(len(free), 5, replace=False).tolist())
        away = solve(~blocked, moves, start).exact
        goal = max(some, key=lambda c: (float(away[c[1], c[0]]), c))
        if away[goal[1], goal[0]] > 0:
            break
    count = int(rng.integers(1, max(2, len(free) // 3)))
    rate = float(rng.uniform(0.2, 1.0)) if rng.random() < 0.3 else None
    return Scene(Grid(blocked), start, goal, moves, traffic=(RandomWalk(count, rate),))


def with_edits(scene: Scene, rng: np.random.Generator, many: int = 3) -> Scene:
    """The same with random edits that leave recorded lanes alone."""
    grid, height, width = scene.grid, scene.grid.height, scene.grid.width
    lanes: set[Cell] = set()
    for one in scene.traffic:
        if isinstance(one, Recorded):
            r = math.ceil(one.radius) + 1
            lanes |= {
                (x + dx, y + dy) for x, y in one.track for dx in range(-r, r + 1) for dy in range(-r, r + 1)
            }
    edits: list[Edit] = []
    tick = 0
    for _ in range(int(rng.integers(1, many + 1))):
        tick += int(rng.integers(1, 8))
        if rng.random() < 0.5:
            # A wall across, with a gap or without.
            x, gap = int(rng.integers(1, width - 1)), int(rng.integers(-4, height))
            line = [(x, y) for y in range(height) if y != gap]
        else:
            line = [(int(rng.integers(width)), int(rng.integers(height))) for _ in range(12)]
        line = [c for c in dict.fromkeys(line) if c not in lanes]
        freed = [(x, y) for y in range(height) for x in range(width) if grid.blocked[y, x]]
        freed = [c for c in freed if rng.random() < 0.2 and c not in line]
        edits.append(Edit(tick, tuple(line), tuple(freed)))
    again = Edit(tick + 3, (), tuple(dict.fromkeys(c for e in edits for c in e.blocked)))
    return replace(scene, edits=(*edits, again))


def harsh_drive(rng: np.random.Generator, seed: int, near: float = 25.0, **fixed: Any) -> Drive | None:
    """A drive with everything at its worst; None where the obstacles do not fit.

    Every third is on a bundled map, between two free cells at most ``near`` cells apart.
    """
    resolution = float(rng.choice([0.25, 0.5, 1.0]))
    if seed % 3 == 0:
        blocked = load(f"env-{1 + int(rng.integers(6))}").grid.blocked
    else:
        blocked = rng.random(tuple(rng.integers(8, 22, 2).tolist())) < rng.choice([0.0, 0.1, 0.2, 0.3])
    free = np.argwhere(~blocked)
    (sy, sx), *others = free[rng.integers(len(free), size=4)].tolist()
    about = free[np.abs(free - (sy, sx)).max(axis=1) <= near]
    gy, gx = about[int(rng.integers(len(about)))].tolist()
    radius = float(rng.uniform(0, 0.45)) * float(rng.choice([0, 1, 1])) * resolution
    robot = Robot(
        radius=radius,
        v_max=float(rng.uniform(0.2, 2)),
        a_max=float(rng.uniform(0.2, 2)),
        d_max=float(rng.uniform(0.3, 2)),
        a_lat_max=float(rng.uniform(0.3, 2)),
        turn_radius=float(rng.choice([0, 0, rng.uniform(0, 2)])),
    )
    size = float(rng.choice([0, 0.3, 0.49])) * resolution
    rate = None if rng.random() < 0.5 else 0.5
    spec: list[ObstacleSpec] = [RandomWalk(int(rng.integers(0, 9)), rate=rate, radius=size)]
    if rng.random() < 0.5:
        spec.append(Crossing(int(rng.integers(1, 5))))
    if rng.random() < 0.4:
        spec.append(Patrol(tuple((x, y) for y, x in others), radius=size))
    cutters = [Adversary(float(rng.uniform(0.2, 2)), count=int(rng.integers(0, 4)), wait=5.0)]
    who = planner(("astar", "theta-star", "ad-gso")[int(rng.integers(3))])
    moves = moves_named(("octile", "dissertation")[int(rng.integers(2))])
    settings = _harsh_settings(rng, resolution) | fixed
    scene = Scene(Grid(blocked, resolution=resolution), (sx, sy), (gx, gy), moves, robot, tuple(spec))
    try:
        return drive(scene, who, seed=seed, sources=cutters, **settings)
    except SceneError as refused:
        if refused.code not in REFUSED:
            raise
        return None


def _harsh_settings(rng: np.random.Generator, resolution: float) -> dict[str, Any]:
    return {
        "law": str(rng.choice([*LAWS, "physical", "physical"])),
        "obstacle_speed": float(rng.uniform(0.1, 2)),
        "obstacle_info": str(rng.choice(["positions", "velocities", "tracks"])),
        "tracking": str(rng.choice(["perfect", "velocity", "position"])),
        "period": float(rng.choice([0.05, 0.1, 0.3])),
        "command_period": None if rng.random() < 0.5 else float(rng.choice([0.05, 0.2, 0.5, 1.0])),
        "delay": float(rng.choice([0, rng.uniform(0, 0.4)])),
        "lag": float(rng.choice([0, 0.1, rng.uniform(0, 1)])),
        "noise": float(rng.choice([0, 0.05, rng.uniform(0, 0.2)])) * resolution,
        "patience": float(rng.choice([0, 0.5, 1, 5])),
        "give_up": 20.0,
        "on_hit": str(rng.choice(["end", "go-on"])),
        "smooth": str(rng.choice(["straight", "none"])),
        "time_limit": 60.0,
    }
