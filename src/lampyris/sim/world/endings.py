"""Endings: the sentence of an answer, with the cells and numbers that say why."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import clearance, free_space, moves_for
from lampyris.planning.field.solve import solve
from lampyris.typing import Cell

if TYPE_CHECKING:
    from lampyris.model.drive import Drive
    from lampyris.model.trace import Trace


def ending_sentence(found: Plan | Trace | Drive, scene: Scene) -> str:
    """The sentence of an answer; where there is no path, with the cells and numbers that say why."""
    word, radius = (found.status if isinstance(found, Plan) else found.outcome).value, scene.robot.radius
    for what, (x, y) in (("start", scene.start), ("goal", scene.goal)):
        if word != f"{what}-occupied":
            continue
        unknown = scene.grid.unknown
        if not scene.grid.blocked[y, x]:
            metres = float(clearance(scene.grid)[y, x])
            where = f"({x}, {y}) is free, but {metres:.3g} m from a wall"
            return f"The {what} {where}; {_size(scene)} is {radius:g} m."
        if unknown is not None and unknown[y, x]:
            return f"The {what} ({x}, {y}) is unknown to the map, which counts as blocked."
        return f"The {what} ({x}, {y}) is blocked."
    if word == Status.NO_PATH.value:
        size = f"{_size(scene).capitalize()} is {radius:g} m." if radius > 0 else ""
        # Searches of the whole map have counted on the way and say so.
        regions = "" if " region" in found.sentence else _regions(scene)
        return " ".join(part for part in (found.sentence, regions, size) if part)
    return found.detail


def _size(scene: Scene) -> str:
    """What the radius is of."""
    return (
        "the robot's radius"
        if scene.robot.footprint is None
        else "the radius of the circle around its footprint"
    )


def _regions(scene: Scene) -> str:
    """How many cells can be reached from either end, where the other is not among them."""
    free, moves = free_space(scene), moves_for(scene)
    reached = [
        solve(free, moves, end, terrain=scene.grid.terrain).exact >= 0 for end in (scene.start, scene.goal)
    ]
    if reached[1][scene.start[1], scene.start[0]]:
        return ""  # it is not the walls
    start, goal = (int(np.count_nonzero(cells)) for cells in reached)
    return f"The start's region has {start:,} cell{'s' * (start > 1)}, the goal's {goal:,}."


def too_late(tick: int) -> str:
    """Why a run ended that was not over at its last tick."""
    return f"The robot had not arrived at tick {tick}, the last."


def gave_up(ticks: int, here: Cell, patience: int, word: str) -> str:
    """Why a run ended in which the robot waited too long; ``word``: what its planner said last."""
    why = f" The planner's last word: {word}" if word else ""
    waited = "1 tick" if ticks == 1 else f"{ticks} ticks in a row"
    return f"Waited {waited} at {here}; the patience is {patience}.{why}"
