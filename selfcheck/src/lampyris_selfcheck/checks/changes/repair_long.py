"""Long lives of a large map: two hundred edits, walls and ground and a robot on its way."""

from __future__ import annotations

import numpy as np

from lampyris_selfcheck.reference.paths.edit_stories import NAMES, Cell, EditStory, StoryEdit

SIDE, EDITS = 64, 200


def long_story(rng: np.random.Generator, number: int) -> EditStory:
    """The step sets take turns; every other one has terrain."""
    blocked = rng.random((SIDE, SIDE)) < rng.choice([0.05, 0.2, 0.35])
    terrain = None
    if number // 4 % 2:
        terrain = (rng.integers(0, 253, (SIDE, SIDE)) * (rng.random((SIDE, SIDE)) < 0.3)).astype(np.uint8)
        terrain[blocked] = 0

    def anywhere() -> Cell:
        return int(rng.integers(SIDE)), int(rng.integers(SIDE))

    start, goal = anywhere(), anywhere()
    blocked[start[1], start[0]] = blocked[goal[1], goal[0]] = False
    out = EditStory(NAMES[number % 4], blocked, terrain, 0.0, start, goal)
    robot, walls = start, blocked.copy()

    def near(cell: Cell, reach: int) -> Cell:
        x, y = (int(v) for v in np.array(cell) + rng.integers(-reach, reach + 1, 2))
        return min(max(x, 0), SIDE - 1), min(max(y, 0), SIDE - 1)

    for _ in range(EDITS):
        one = StoryEdit()
        if rng.random() < 0.7:
            robot = one.robot = next(
                (c for c in (near(robot, 2) for _ in range(8)) if not walls[c[1], c[0]]), robot
            )
        count = int(rng.choice([1, 1, 1, 2, 6, 40], p=[0.3, 0.2, 0.2, 0.15, 0.1, 0.05]))
        cells = [near(robot if rng.random() < 0.4 else goal, 6) if rng.random() < 0.6 else anywhere()
                 for _ in range(count)]  # fmt: skip
        kept = [c for c in dict.fromkeys(cells) if c not in (robot, goal) or rng.random() < 0.05]
        one.blocked = tuple(c for c in kept if not walls[c[1], c[0]])
        one.freed = tuple(c for c in kept if walls[c[1], c[0]])
        # A map that only fills up or empties would be dull: what is blocked comes to be freed.
        for x, y in kept:
            walls[y, x] = not walls[y, x]
        if terrain is not None and rng.random() < 0.5:
            values = rng.choice([0, 1, 40, 252], int(rng.integers(1, 9)))
            one.terrain = tuple((anywhere(), int(v)) for v in values)
        if rng.random() < 0.2:
            one.obstacles = frozenset(near(robot, 4) for _ in range(int(rng.integers(1, 12))))
        out.edits.append(one)
    return out
