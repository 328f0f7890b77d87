"""The next steps of AD-GSO from a cell among obstacles: what a simulation asks for again and again."""

from __future__ import annotations

from lampyris.kernels._jit import PATH, kernel
from lampyris.kernels.adgso.lookahead_walk import walk_known
from lampyris.kernels.adgso.walk import AT, LENGTH, OBSTACLE, STOP, WALL


@kernel(
    out=(
        "shut", "pairs", "tally", "path", "wall", "toll", "mark", "dist", "queue", "queued", "sub_path", "known",
    ),
    each=24_000,
    of=PATH,
)  # fmt: skip
def next_steps(
    robot, closed, count, pairs, cost, luc, step, shut, terrain, setup, tally, path,
    ring_dx, ring_dy, ring_at, near, far, price, wall, toll, mark, dist, queue, queued, sub_path,
    known, lower, wanted, halt,
):  # fmt: skip
    """Walk from a cell; the reason to stop of :func:`lampyris.kernels.adgso.walk.walk`.

    Parameters
    ----------
    robot : the cell.
    closed, count : cells that obstacles close, and how many there are.
    pairs : room for x and y of each.
    cost .. wanted : see :func:`lampyris.kernels.adgso.lookahead_walk.walk_known`.
    """
    width = setup[0]
    for k in range(count):
        cell = closed[k]
        shut[cell] |= OBSTACLE
        pairs[2 * k + 1] = cell // width
        pairs[2 * k] = cell - cell // width * width
    for k in range(STOP):
        tally[k] = 0
    tally[AT] = robot
    tally[LENGTH] = 1
    path[0] = robot
    code = walk_known(
        cost, luc, step, shut, terrain, setup, tally, path,
        ring_dx, ring_dy, ring_at, near, far, price, wall, toll, mark, dist, queue, queued, sub_path,
        known, pairs, count, lower, wanted, halt,
    )  # fmt: skip
    for k in range(count):
        shut[closed[k]] &= WALL
    return code
