"""Sessions that share what they compute from a map: each answers as one that shares nothing, whatever the others are asked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.base import Planner, Session, SessionBase
from lampyris_selfcheck.check import Tally
from lampyris_selfcheck.reference.paths.changing_map import Cell

CALLS = 16
"""Calls of a case."""
SESSIONS = 3
"""Sessions that share a map at the same time."""
VARIANTS: tuple[tuple[str, dict[str, object]], ...] = (
    ("ad-gso", {}),
    ("sipp", {"margin": 0}),
    ("ad-gso", {"choice": "exact"}),
    ("sipp", {}),
    ("ad-gso", {"gates": "replan"}),
)
"""Planners whose sessions share: AD-GSO its field, SIPP its distances to the goal."""


@cache
def planners() -> tuple[Planner, ...]:
    """The planners, which take turns."""
    return tuple(registry.make(name, settings) for name, settings in VARIANTS)


@dataclass
class Pair:
    """A session that shares, one that does not, and what both were given."""

    shared: Session
    alone: Session
    blocked: set[Cell]
    robot: Cell
    tick: int = 0


def sharing(number: int, rng: np.random.Generator, tally: Tally) -> str:
    """One case; what is wrong in it, or nothing."""
    planner = planners()[number % len(VARIANTS)]
    tally.case(planner.name)
    scene = _scene(rng)
    pairs = [_pair(planner, scene, rng) for _ in range(SESSIONS)]
    for call in range(CALLS):
        if rng.random() < 0.15:
            pairs[int(rng.integers(SESSIONS))] = _pair(planner, scene, rng)
            tally.count("opened later")
        pair = pairs[int(rng.integers(SESSIONS))]
        change = _change(pair, scene, rng, tally)
        found, expected = pair.shared.plan(change), pair.alone.plan(change)
        if replace(found, timing={}) != replace(expected, timing={}):
            return f"{planner}, call {call}: {found} with sharing, {expected} without"
        tally.count(f"answers: {found.status.value}")
        if found.path is not None:
            reached = min(int(rng.integers(4)), len(found.path.cells) - 1)
            pair.robot = (int(found.path.cells[reached][0]), int(found.path.cells[reached][1]))
            pair.tick += reached
    return ""


def _scene(rng: np.random.Generator) -> Scene:
    height, width = (int(n) for n in rng.integers(5, 15, 2))
    blocked = rng.random((height, width)) < rng.choice([0.05, 0.15, 0.3])
    start, goal = (0, 0), (width - 1, height - 1)
    blocked[:2, :2] = blocked[-2:, -2:] = False
    moves = str(rng.choice(["octile", "dissertation", "four-connected"]))
    return Scene(Grid(blocked), start, goal, moves, Robot(radius=float(rng.choice([0.0, 0.0, 0.8]))))


def _pair(planner: Planner, scene: Scene, rng: np.random.Generator) -> Pair:
    """Two sessions on one map, of which one shares."""
    seed = int(rng.integers(2**32))
    shared, alone = (planner.open(scene, np.random.default_rng(seed)) for _ in range(2))
    assert isinstance(shared, SessionBase)
    shared.share_map()
    ys, xs = np.nonzero(scene.grid.blocked)
    return Pair(shared, alone, set(zip(xs.tolist(), ys.tolist(), strict=True)), scene.start)


def _change(pair: Pair, scene: Scene, rng: np.random.Generator, tally: Tally) -> Change:
    """The next change of a pair: cells that become blocked or free, now and then, and a few obstacles."""
    grid = scene.grid
    drawn = {
        (int(rng.integers(grid.width)), int(rng.integers(grid.height)))
        for _ in range(int(rng.integers(0, 5)))
    } - {pair.robot, scene.goal}
    edited = drawn if rng.random() < 0.5 else set()
    freed, blocked = edited & pair.blocked, edited - pair.blocked
    pair.blocked = (pair.blocked | blocked) - freed
    obstacles = drawn - pair.blocked if not edited else set()
    if edited:
        tally.count("edited")
    return Change(
        robot=pair.robot,
        obstacles=frozenset(obstacles),
        blocked=tuple(sorted(blocked)),
        freed=tuple(sorted(freed)),
        tick=pair.tick,
    )
