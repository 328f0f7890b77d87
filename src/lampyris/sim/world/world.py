"""Occupancy: where every obstacle is and what it did in this tick, and which steps are legal.

For every two obstacles, always: never two in one cell, never a swap, never both diagonals of one 2x2 block in
one tick. For obstacles with a size the same is asked of their footprints: they never meet; not both does A now
meet B's last place and B A's; and no cell of A's footprint crosses one of B's.

Obstacles move one after the other. One that has moved is met at its new place and remembered at its old; one
that has yet to move is met where it is, so that staying is always legal for it. A swap of two obstacles
therefore cannot come about (the first would have to enter a cell that the second still covers), and only
crossing needs its own test among them. The robot moves last and is tested for all three.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from lampyris.model.traffic import Recorded
from lampyris.sim.world.cell_index import CellIndex, Shape, Step, passed
from lampyris.typing import BoolGrid


class Occupancy:
    """Positions of the obstacles and of the robot within one tick.

    Attributes
    ----------
    taken : cell number -> the obstacle that covers it now.
    left : cell number -> the obstacle that covered it before its step of this tick.
    where, step, shapes : by obstacle: its cell number, its last step (dx, dy), its shape.
    robot : the robot's cell number; ``robot_cover`` its footprint there.
    """

    def __init__(self, space: CellIndex, robot_shape: Shape, robot: int) -> None:
        self.space = space
        self.robot_shape = robot_shape
        self.taken: dict[int, int] = {}
        self.left: dict[int, int] = {}
        self.where: list[int] = []
        self.step: list[tuple[int, int]] = []
        self.shapes: list[Shape] = []
        self._moved: list[int] = []
        self.put_robot(robot)

    def put_robot(self, number: int) -> None:
        """Stand the robot on a cell."""
        self.robot = number
        self.robot_cover = frozenset(self.robot_shape.cover(number))

    def begin(self) -> None:
        """Begin a tick: nobody has moved."""
        self.left.clear()
        for obstacle in self._moved:
            self.step[obstacle] = (0, 0)
        self._moved.clear()

    def moved(self, obstacles: Sequence[int]) -> None:
        """Obstacles that have made a step in this tick."""
        self._moved[:] = obstacles

    def add(self, shape: Shape, number: int) -> int:
        """A new obstacle on a cell; its index."""
        obstacle = len(self.where)
        self.where.append(number)
        self.step.append((0, 0))
        self.shapes.append(shape)
        for c in shape.cover(number):
            self.taken[c] = obstacle
        return obstacle

    def add_small(self, shape: Shape, numbers: Sequence[int]) -> Sequence[int]:
        """New obstacles of one cell, each on a cell of its own; their indices."""
        first = len(self.where)
        added = range(first, first + len(numbers))
        self.where += numbers
        self.step += [(0, 0)] * len(numbers)
        self.shapes += [shape] * len(numbers)
        self.taken.update(zip(numbers, added, strict=True))
        return added

    def opened(self, shape: Shape) -> NDArray[np.uint8]:
        """Where an obstacle of one cell could be put now, by cell number; uint8."""
        opened = shape.opened()
        for cells in (self.taken, self.robot_cover):
            for cell in cells:
                opened[cell] = 0
        return np.frombuffer(opened, dtype=np.uint8)

    def lane_bars(self, tracks: Sequence[Recorded], radius: float) -> BoolGrid | None:
        """Where obstacles of that radius (metres) may not be beside recorded tracks, besides on them; bool,
        (height, width), or None. In ticks: nowhere.
        """
        return None

    # ---- obstacles --------------------

    def may_step(self, obstacle: int, step: Step, yields: bool) -> bool:
        """Whether an obstacle may make this step now, as far as others (with the robot, if it yields) go."""
        to, dx, dy = step
        shape = self.shapes[obstacle]
        taken = self.taken
        for c in shape.cover(to):
            if taken.get(c, obstacle) != obstacle or (yields and c in self.robot_cover):
                return False
        return not (dx and dy and self.left and self._crosses(shape.cover(self.where[obstacle]), dx, dy))

    def options(self, obstacle: int) -> list[Step]:
        """Every step a yielding obstacle may make now, staying left out."""
        at = self.where[obstacle]
        shape = self.shapes[obstacle]
        # As may_step says, without the calls: this is the inner loop of heavy traffic.
        taken, robot, cover = self.taken, self.robot_cover, shape.cover(at)
        if not shape.small:
            # What the obstacle covers now is its own, so only the cells that it enters are looked up.
            nobody_on = taken.keys().isdisjoint
            return [
                s
                for s, covered, entered in shape.entries(at)
                if nobody_on(entered)
                and robot.isdisjoint(covered)
                and not (s[1] and s[2] and self.left and self._crosses(cover, s[1], s[2]))
            ]
        return [
            s
            for s in shape.steps(at)
            if s[0] not in taken
            and s[0] not in robot
            and not (s[1] and s[2] and self._crosses(cover, s[1], s[2]))
        ]

    def move(self, obstacle: int, step: Step) -> None:
        """Make a legal step."""
        to, dx, dy = step
        shape = self.shapes[obstacle]
        for c in shape.cover(self.where[obstacle]):
            del self.taken[c]
            self.left[c] = obstacle
        for c in shape.cover(to):
            self.taken[c] = obstacle
        self.where[obstacle] = to
        self.step[obstacle] = (dx, dy)
        self._moved.append(obstacle)

    def move_together(self, moves: Iterable[tuple[int, Step]]) -> None:
        """Make steps of several obstacles at one instant: each may enter what another leaves."""
        moves = list(moves)
        for obstacle, _ in moves:
            for c in self.shapes[obstacle].cover(self.where[obstacle]):
                del self.taken[c]
                self.left[c] = obstacle
        for obstacle, (to, dx, dy) in moves:
            for c in self.shapes[obstacle].cover(to):
                self.taken[c] = obstacle
            self.where[obstacle] = to
            self.step[obstacle] = (dx, dy)
            self._moved.append(obstacle)

    def room(self, shape: Shape) -> BoolGrid:
        """Where an obstacle of that shape could be put now without meeting another; bool, (height, width)."""
        mask = shape.open.copy()
        height, width = mask.shape
        taken = (*self.taken, *self.robot_cover)  # bits: each takes its own cell away
        xy = np.array([self.space.cell(c) for c in taken], dtype=np.int64)
        for dx, dy in shape.offsets:
            x, y = xy[:, 0] - dx, xy[:, 1] - dy
            inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
            mask[y[inside], x[inside]] = False
        return mask

    def fits(self, shape: Shape, number: int) -> bool:
        """Whether an obstacle of that shape could be put on this cell now without meeting another."""
        return not any(c in self.taken or c in self.robot_cover for c in shape.cover(number))

    # ---- the robot --------------------

    def robot_is_met(self) -> bool:
        """Whether an obstacle has come to cover a cell of the robot's."""
        return any(c in self.taken for c in self.robot_cover)

    def robot_steps(self) -> list[Step]:
        """Every step that walls allow the robot from where it stands."""
        return list(self.robot_shape.steps(self.robot))

    def robot_may(self, step: Step) -> bool:
        """Whether the robot may make this step now: nobody there, no swap, no crossing."""
        to, dx, dy = step
        taken, left = self.taken, self.left
        new = self.robot_shape.cover(to)
        if any(c in taken for c in new):
            return False
        for c in new:
            obstacle = left.get(c)
            if obstacle is not None and any(taken.get(o) == obstacle for o in self.robot_cover):
                return False
        if abs(dx) == 2 or abs(dy) == 2:
            # A knight's step sweeps over two more cells within the tick: nobody may be there or have been
            # there.
            beside = [self.robot + sy * self.space.stride + sx for sx, sy in passed(dx, dy)]
            return not any(c in taken or c in left for b in beside for c in self.robot_shape.cover(b))
        return not (dx and dy and left and self._crosses(self.robot_cover, dx, dy))

    def _crosses(self, cover: Iterable[int], dx: int, dy: int) -> bool:
        """Whether a diagonal step of these cells crosses a diagonal driven in this tick."""
        left, step = self.left, self.step
        row = dy * self.space.stride
        for c in cover:
            obstacle = left.get(c + dx)
            if obstacle is not None and step[obstacle] == (-dx, dy):
                return True
            obstacle = left.get(c + row)
            if obstacle is not None and step[obstacle] == (dx, -dy):
                return True
        return False
