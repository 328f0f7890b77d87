"""Sense: from the world to the Change that a planner receives."""

from __future__ import annotations

from lampyris.model.change import Change, ObstacleTrack
from lampyris.sim.traffic.traffic import Traffic
from lampyris.sim.world.world import Occupancy
from lampyris.typing import Cell


def seen_cells(world: Occupancy) -> list[Cell]:
    """Every cell that a moving obstacle covers now, in the order in which they came to cover it."""
    return world.space.pairs(world.taken)


def closed_cells(world: Occupancy) -> set[Cell]:
    """Every cell on which the robot, with its size, would now meet a moving obstacle; its own cell never
    among them.

    The own cell is left out because a planner asked to start from an obstacle has no answer; when an
    obstacle that does not yield has come onto the robot, what is wanted is a path out of there.
    """
    shape, space = world.robot_shape, world.space
    cell = space.cell
    if shape.small:
        cells = set(space.pairs(world.taken))
    else:
        width, height = space.width, space.height
        around = [(x + dx, y + dy) for x, y in map(cell, world.taken) for dx, dy in shape.offsets]
        cells = {(x, y) for x, y in around if 0 <= x < width and 0 <= y < height}
    cells.discard(cell(world.robot))
    return cells


def observed_obstacles(traffic: Traffic, now: int) -> tuple[ObstacleTrack, ...]:
    """Every moving obstacle with what is known of it: its last step and place; a recorded track whole.

    Parameters
    ----------
    traffic : all obstacle_tracks, at tick ``now``.
    now : the tick of their places.
    """
    world = traffic.world
    recorded = {} if traffic.recording is None else dict(traffic.recording.tracks)
    seen = []
    each = zip(traffic.obstacles, traffic.appears, world.space.pairs(world.where), world.step, strict=True)
    for obstacle, (kind, since, (x, y), (dx, dy)) in enumerate(each):
        cells = kind.footprint
        if recorded and obstacle in recorded:
            seen.append(ObstacleTrack(obstacle, recorded[obstacle].track, 0, 1, cells))
        elif since == now:  # one that has just appeared was nowhere a tick ago
            seen.append(ObstacleTrack(obstacle, ((x, y),), now, None, cells))
        else:
            seen.append(ObstacleTrack(obstacle, ((x - dx, y - dy), (x, y)), now - 1, None, cells))
    return tuple(seen)


def sense(
    world: Occupancy, *, tick: int = 0, obstacle_tracks: tuple[ObstacleTrack, ...] | None = None
) -> Change:
    """What the robot tells its planner: where it stands, and every cell that is closed to its next step.

    Parameters
    ----------
    tick : when the robot stands there.
    obstacle_tracks : for planners that see traffic.

    To the closed cells come those neighbours which nobody covers but which the robot could not enter in
    this tick without swapping places or crossing (an obstacle has just come from there). A planner that is
    informed of them once chooses another step at once; one that is not would choose the same step again and
    wait, or be hit.
    """
    cells = closed_cells(world)
    for step in world.robot_steps():
        if not world.robot_may(step):
            cells.add(world.space.cell(step[0]))
    robot = world.space.cell(world.robot)
    return Change(robot=robot, obstacles=frozenset(cells), tick=tick, obstacle_tracks=obstacle_tracks)
