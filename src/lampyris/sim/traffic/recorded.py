"""Recorded tracks: checked before the first tick, because a replay asks nobody while it runs.

A track must keep out of walls, out of the robot's start at tick 0, and out of every other track's path. All
cells that a track ever covers are its lane; no other kind of obstacle enters a lane (see
:mod:`lampyris.sim.traffic.traffic`).
"""

from __future__ import annotations

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.traffic import Recorded
from lampyris.sim.world.cell_index import CellIndex, Shape
from lampyris.typing import BoolGrid


def position(track: Recorded, tick: int) -> tuple[int, int]:
    """The cell of a recorded obstacle at a tick; after its end it stays."""
    return track.track[min(tick, len(track.track) - 1)]


def check_tracks(
    space: CellIndex, tracks: list[tuple[int, Recorded, Shape]], robot_cover: frozenset[int]
) -> BoolGrid:
    """Refuse tracks that cannot be replayed, and mark every cell that they ever cover.

    Parameters
    ----------
    tracks : (index of the obstacle in the scene, its track, its shape).
    robot_cover : numbers of the cells the robot covers at tick 0.

    Returns
    -------
    bool, (height, width): the lanes.

    Raises
    ------
    SceneError : ``OBSTACLE_TRACK`` into a wall, ``OBSTACLE_START`` on the robot, ``OBSTACLE_OVERLAP`` two
        in one cell, swapping places or crossing.
    """
    lanes = np.zeros((space.height, space.width), dtype=np.bool_)
    for k, one, shape in tracks:
        for x, y in dict.fromkeys(one.track):
            if not shape.free[y, x]:
                raise SceneError(
                    "OBSTACLE_TRACK",
                    f"obstacle {k} meets a wall at ({x}, {y}), t = {one.track.index((x, y))}",
                    allowed="cells where the obstacle's whole footprint is free",
                )
            for c in shape.cover(space.number((x, y))):
                cx, cy = space.cell(c)
                lanes[cy, cx] = True
        if robot_cover.intersection(shape.cover(space.number(one.track[0]))):
            raise SceneError(
                "OBSTACLE_START",
                f"obstacle {k} is on the robot at t = 0, {one.track[0]}",
                allowed="a track that begins clear of the robot's start",
            )
    if not _far_apart(tracks):
        _check_pairs(space, tracks)
    return lanes


def _far_apart(tracks: list[tuple[int, Recorded, Shape]]) -> bool:
    """Whether obstacles of one cell can be seen at once never to meet: nobody else in a cell before or after.

    True is certain; False says nothing. Twenty tracks of 150 ticks take 1 ms, and 10 ms one by one.
    """
    if not all(shape.small for _, _, shape in tracks) or not tracks:
        return not tracks
    longest = max(len(one.track) for _, one, _ in tracks)
    at = np.empty((longest, len(tracks)), dtype=np.int64)
    row = 2 * tracks[0][2].space.stride  # so that sums of two places say both coordinates
    for i, (_, one, _) in enumerate(tracks):
        xy = np.array(one.track, dtype=np.int64)
        at[: len(xy), i] = xy[:, 1] * row + xy[:, 0]
        at[len(xy) :, i] = at[len(xy) - 1, i]
    rank = np.sort(at, axis=1)
    if (rank[:, 1:] == rank[:, :-1]).any():
        return False
    # Two that change places, or cross in a block of four cells, have one middle between where they come from
    # and where they go. Those that stand have none.
    alone = -1 - np.arange(len(tracks))
    middle = np.sort(np.where(at[1:] == at[:-1], alone, at[1:] + at[:-1]), axis=1)
    return not (middle[:, 1:] == middle[:, :-1]).any()


def _check_pairs(space: CellIndex, tracks: list[tuple[int, Recorded, Shape]]) -> None:
    last: dict[int, int] = {}
    numbers: list[int] = []
    for t in range(max((len(one.track) for _, one, _ in tracks), default=0)):
        now: dict[int, int] = {}
        before, numbers = numbers, []
        for i, (_, one, shape) in enumerate(tracks):
            numbers.append(space.number(position(one, t)))
            for c in shape.cover(numbers[i]):
                if now.setdefault(c, i) != i:
                    raise _overlap(tracks, now[c], i, t, "are in one cell", space, c)
        if t:
            for i, (_, _, shape) in enumerate(tracks):
                if numbers[i] != before[i]:
                    _check_step(space, tracks, i, t, (before, numbers), (last, now), shape)
        last = now


def _check_step(
    space: CellIndex,
    tracks: list[tuple[int, Recorded, Shape]],
    i: int,
    t: int,
    numbers: tuple[list[int], list[int]],
    covers: tuple[dict[int, int], dict[int, int]],
    shape: Shape,
) -> None:
    before, after = numbers
    last, now = covers
    old, new = shape.cover(before[i]), shape.cover(after[i])
    for c in new:
        j = last.get(c, i)
        if j != i and any(now.get(o) == j for o in old):
            raise _overlap(tracks, i, j, t, "swap places", space, c)
    jump = after[i] - before[i]
    dy = round(jump / space.stride)
    dx = jump - dy * space.stride
    if not (dx and dy):
        return
    for c in old:
        for beside, back in (
            (c + dx, dy * space.stride - dx),
            (c + dy * space.stride, dx - dy * space.stride),
        ):
            j = last.get(beside, i)
            if j != i and after[j] - before[j] == back:
                raise _overlap(tracks, i, j, t, "cross each other diagonally", space, c)


def _overlap(
    tracks: list[tuple[int, Recorded, Shape]],
    i: int,
    j: int,
    t: int,
    what: str,
    space: CellIndex,
    number: int,
) -> SceneError:
    a, b = sorted((tracks[i][0], tracks[j][0]))
    return SceneError(
        "OBSTACLE_OVERLAP",
        f"obstacles {a} and {b} {what} at {space.cell(number)}, t = {t}",
        allowed="tracks that never meet",
        todo="leave out one of them or shift its times",
    )
