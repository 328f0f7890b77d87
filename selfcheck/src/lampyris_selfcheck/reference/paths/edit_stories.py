"""Seeded lives of a changing map: walls that come and go, other ground, obstacles, a robot that moves.

Plain values only; each test makes of them what it needs.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

Cell = tuple[int, int]

NAMES = ("dissertation", "octile", "four-connected", "sixteen-connected")


@dataclass
class StoryEdit:
    robot: Cell | None = None
    blocked: tuple[Cell, ...] = ()
    freed: tuple[Cell, ...] = ()
    terrain: tuple[tuple[Cell, int], ...] = ()
    obstacles: frozenset[Cell] = frozenset()


@dataclass
class EditStory:
    name: str
    blocked: np.ndarray
    terrain: np.ndarray | None
    radius: float
    start: Cell
    goal: Cell
    edits: list[StoryEdit] = field(default_factory=list)


def side(rng: np.random.Generator) -> int:
    """5 to 64 cells, mostly few: what goes wrong shows on small maps, where a plain judge is quick."""
    return int(rng.integers(5, rng.choice([10, 16, 24, 40, 65], p=[0.25, 0.2, 0.2, 0.15, 0.2])))


def story(seed: int, number: int, edits: int = 6) -> EditStory:
    """The step sets take turns, terrain and robots with a size are drawn; same numbers, same story."""
    rng = np.random.default_rng([seed, number])
    height, width = side(rng), side(rng)
    blocked = rng.random((height, width)) < rng.choice([0.0, 0.1, 0.2, 0.3, 0.4])
    terrain = None
    if rng.random() < 0.4:
        terrain = rng.integers(0, 253, (height, width)) * (rng.random((height, width)) < rng.random())
        terrain = np.where(blocked, 0, terrain).astype(np.uint8)

    def anywhere() -> Cell:
        return int(rng.integers(width)), int(rng.integers(height))

    start, goal = anywhere(), anywhere()
    if rng.random() < 0.9:
        blocked[start[1], start[0]] = blocked[goal[1], goal[0]] = False
    radius = float(rng.choice([0, 0, 0, 0, 0, 0.8, 1.3]))
    out = EditStory(NAMES[number % 4], blocked, terrain, radius, start, goal)
    robot, last, walls = start, goal, blocked.copy()

    def somewhere() -> Cell:
        """Near the robot, the goal, the last change, or anywhere."""
        place = (robot, goal, last, None)[int(rng.integers(4))]
        if place is None:
            return anywhere()
        x, y = (int(v) for v in np.array(place) + rng.integers(-3, 4, 2))
        return min(max(x, 0), width - 1), min(max(y, 0), height - 1)

    for _ in range(edits):
        one = StoryEdit()
        if rng.random() < 0.6:
            for _ in range(int(rng.integers(1, 9))):
                robot = one.robot = somewhere() if rng.random() < 0.7 else anywhere()
                if not walls[robot[1], robot[0]]:
                    break
        count = int(rng.choice([0, 1, 1, 2, 4, 12]))
        built = rng.random() < 0.5
        cells = tuple(somewhere() for _ in range(count))
        if rng.random() < 0.9:
            cells = tuple(c for c in cells if c not in (robot, goal))
        if rng.random() < 0.3:
            one.blocked, one.freed = cells[::2], cells[1::2]
        else:
            one.blocked, one.freed = (cells, ()) if built else ((), cells)
        if rng.random() < 0.15:
            one.freed += tuple(anywhere() for _ in range(width * height // 4))
        if rng.random() < (0.05 if terrain is None else 0.6):
            values = rng.choice([0, 1, 40, 252], int(rng.integers(1, 9)))
            one.terrain = tuple((somewhere(), int(v)) for v in values)
        for these, wall in ((one.freed, False), (one.blocked, True)):
            for x, y in these:
                walls[y, x] = wall
        one.obstacles = frozenset(somewhere() for _ in range(int(rng.choice([0, 0, 0, 1, 3, 9]))))
        last = cells[-1] if cells else last
        out.edits.append(one)
    return out
