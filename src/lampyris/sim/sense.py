"""Sense: from the world to the Change that a planner is told."""

from __future__ import annotations

from lampyris.model.change import Change
from lampyris.sim.world import World
from lampyris.typing import Cell


def seen_cells(world: World) -> list[Cell]:
    """Every cell that a moving obstacle covers now, in the order in which they came to cover it."""
    cell = world.space.cell
    return [cell(c) for c in world.taken]


def closed_cells(world: World) -> set[Cell]:
    """Every cell on which the robot, with its size, would now meet a moving obstacle; its own cell never
    among them.

    The own cell is left out because a planner asked to start from an obstacle has no answer; when an
    obstacle that does not yield has come onto the robot, what is wanted is a way out of there.
    """
    shape, space = world.robot_shape, world.space
    cell = space.cell
    if shape.small:
        cells = {cell(c) for c in world.taken}
    else:
        width, height = space.width, space.height
        around = [(x + dx, y + dy) for x, y in map(cell, world.taken) for dx, dy in shape.offsets]
        cells = {(x, y) for x, y in around if 0 <= x < width and 0 <= y < height}
    cells.discard(cell(world.robot))
    return cells


def sense(world: World) -> Change:
    """What the robot tells its planner: where it stands, and every cell that is closed to its next step.

    To the closed cells come those neighbours which nobody covers but which the robot could not enter in
    this tick without swapping places or crossing (an obstacle has just come from there). A planner that is
    told of them once chooses another step at once; one that is not would choose the same step again and
    wait, or be hit.
    """
    cells = closed_cells(world)
    for step in world.robot_steps():
        if not world.robot_may(step):
            cells.add(world.space.cell(step[0]))
    return Change(robot=world.space.cell(world.robot), obstacles=frozenset(cells))
