"""Race: planners that explore the same map, each in its own order, and then drive what they found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

import numpy as np

from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.typing import Cell, Cells, Floats

MOST_RACERS: Final = 6
"""Planners of a race at most; the page has it with its settings."""

RecordKind: TypeAlias = Literal["cells", "jump points", "poses", "field and rings", "tree", "none"]
"""What a planner records of its search."""


@dataclass(frozen=True, slots=True, eq=False)
class Exploration:
    """What a planner looks at until it has its path, in its own order.

    Parameters
    ----------
    kind : what is recorded.
    cells : int32 (n, 2): cells expanded, first come first; of ``poses`` the cell in which each lies; of
        ``field and rings`` those of the field, then those of the rings around each place that the robot jumps from. A cell
        that is expanded twice is there twice.
    lines : float64 (m, 4): of ``tree`` its lines, x0, y0, x1, y1, cells.
    field : how many of the first cells are those of the field.
    jumps : of ``field and rings``: how many cells had been looked at, and the cell that was jumped to.
    note : a sentence a person should read; empty: there is nothing to say.
    """

    kind: RecordKind
    cells: Cells
    lines: Floats
    field: int = 0
    jumps: tuple[tuple[int, Cell], ...] = ()
    note: str = ""

    @property
    def steps(self) -> int:
        """How many steps the record has."""
        return len(self.lines) if self.kind == "tree" else len(self.cells)


@dataclass(frozen=True, slots=True, eq=False)
class Racer:
    """One planner in a race.

    Parameters
    ----------
    label : what it is called.
    plan : its answer.
    exploration : what it looked at.
    plan_s : seconds of one planning call, without loading or compiling: the median of several.
    nodes : float64 (n, 2), cells: the nodes that it drives along; none without a path.
    times : float64 (n,): when it is at each, by the speed law.
    mean_speed : along the path, in the law's unit; 0 without a path.
    resolution : metres of a cell.
    headings : float64 (n,), radians counterclockwise from the rows of the grid: the robot's heading at each node, of a
        planner of poses; of others none.
    """

    label: str
    plan: Plan
    exploration: Exploration
    plan_s: float
    nodes: Floats
    times: Floats
    mean_speed: float = 0.0
    resolution: float = 1.0
    headings: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def length(self) -> float:
        """Length of what was found, in cells: of poses and of lines of any angle theirs; infinity without a path."""
        if self.plan.pose_path is not None:
            return self.plan.pose_path.length_m / self.resolution
        line = self.plan.any_angle_length
        return self.plan.cost if line is None else line


@dataclass(frozen=True, slots=True, eq=False)
class Race:
    """Planners in one scene.

    Parameters
    ----------
    scene : where.
    racers : who, in the order given.
    seconds : whether times are seconds; transfers of the dissertation's law otherwise.
    """

    scene: Scene
    racers: tuple[Racer, ...]
    seconds: bool = True

    @property
    def steps(self) -> int:
        """Steps of the longest record."""
        return max((one.exploration.steps for one in self.racers), default=0)

    @property
    def duration(self) -> float:
        """When the last robot arrives."""
        return max((float(one.times[-1]) for one in self.racers if len(one.times)), default=0.0)
