"""A guest planner: breadth first, by the public contract alone."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.change import Change
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase, Traits
from lampyris.planning.edits import edited
from lampyris.planning.field.layers import free_space, moves_for


@dataclass(frozen=True, slots=True)
class Guest:
    """Breadth-first search; ``turns`` is a setting with no other use than to be set."""

    turns: int = 1

    name: ClassVar[str] = "guest"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = "Fewest steps, by breadth-first search."
    source: ClassVar[str] = "A guest package."

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GuestSession:
        """Start a session."""
        return GuestSession(scene)


class GuestSession(SessionBase):
    """Remembers the scene and the robot."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.robot = scene, scene.start
        self.under_walls: dict[tuple[int, int], int] = {}  # so that a freed cell has its terrain again

    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """Fewest steps from the robot to the goal."""
        change = change or Change()
        self.scene = edited(self.scene, change, self.under_walls)
        self.robot = change.robot or self.robot
        free, goal = free_space(self.scene).copy(), self.scene.goal
        for status, (x, y) in ((Status.START_OCCUPIED, self.robot), (Status.GOAL_OCCUPIED, goal)):
            if not free[y, x]:
                return Plan(status, "guest")
        taken = {c for c in change.obstacles if self.scene.grid.contains(c)} - {self.robot, goal}
        for x, y in taken:
            free[y, x] = False
        most = budget.expansions if budget is not None else None
        return self.search(free, moves_for(self.scene), most, bool(taken))

    def search(self, free, moves, most, taken) -> Plan:
        """Breadth first."""
        goal, came = self.scene.goal, {self.robot: None}
        queue, expansions = deque([self.robot]), 0
        while queue:
            cell = queue.popleft()
            if cell == goal:
                way = [cell]
                while came[way[-1]] is not None:
                    way.append(came[way[-1]])
                path = path_of(np.array(way[::-1]), moves, self.scene.grid.terrain)
                return Plan(Status.FOUND, "guest", path, iterations=1, expansions=expansions)
            if expansions == most:
                return Plan(Status.LIMIT, "guest", expansions=expansions)
            expansions += 1
            for dx, dy in moves.offsets:
                to = (cell[0] + dx, cell[1] + dy)
                if to not in came and self.may(free, moves, cell, dx, dy):
                    came[to] = cell
                    queue.append(to)
        if taken:
            # Walls may leave a way that only obstacles close.
            bare = self.search(free_space(self.scene), moves, None, False)
            if bare:
                return Plan(Status.HEMMED_IN, "guest", expansions=expansions)
        return Plan(Status.NO_PATH, "guest", expansions=expansions)

    def may(self, free, moves, cell, dx, dy) -> bool:
        """Whether a step is legal."""
        (x, y), (height, width) = cell, free.shape
        if not (0 <= x + dx < width and 0 <= y + dy < height) or not free[y + dy, x + dx]:
            return False
        if abs(dx) == 2 or abs(dy) == 2:
            sx, sy = (dx // 2, 0) if abs(dx) == 2 else (0, dy // 2)
            far = (dx // 2, dy) if abs(dx) == 2 else (dx, dy // 2)
            return bool(free[y + sy, x + sx] and free[y + far[1], x + far[0]])
        return not (dx and dy) or moves.corner_cutting or bool(free[y, x + dx] and free[y + dy, x])
