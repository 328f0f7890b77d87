"""A path of straight lines: the best sequence of free lines between some of its points, where it turns, and its cells."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.graph.any_angle import follow
from lampyris.kernels.sampling.draws import length
from lampyris.kernels.sampling.lines import line_free
from lampyris.kernels.sampling.tree import EQUAL


@kernel(out=("best", "before"), of="best", each=150_000)
def shorten(free, even, stride, rule, x, y, best, before, halt):
    """For each point the shortest path of free lines from the first through earlier points.

    The line from each point to the next is taken to be free only where it is, too; where it is not, ``best`` has another way.

    Parameters
    ----------
    free, even, stride, rule : see :func:`lampyris.kernels.sampling.lines.line_free`.
    x, y : int64 (k,): the points, padded, in order.
    best : float64 (k,): lengths; negative: no way.
    before : int64 (k,): the point before each.
    """
    best[0] = 0.0
    before[0] = -1
    for j in range(1, len(x)):
        if stopped(halt):
            return
        best[u64(j)] = -1.0
        before[u64(j)] = -1
        for i in range(j):
            if best[u64(i)] < 0.0:
                continue
            through = best[u64(i)] + length(x[u64(i)], y[u64(i)], x[u64(j)], y[u64(j)])
            if best[u64(j)] < 0.0 or through < best[u64(j)] - EQUAL:
                if line_free(free, even, stride, x[u64(i)], y[u64(i)], x[u64(j)], y[u64(j)], rule):
                    best[u64(j)] = through
                    before[u64(j)] = i


@kernel(out=("turn_x", "turn_y", "path", "turns", "walk", "count"), of="path", each=1000)
def lay(free, stride, pad, x, y, diagonals, turn_x, turn_y, path, turns, walk, count, halt):
    """The turning points of a path of straight lines, and a walk by single steps along it; both without the padding.

    Parameters
    ----------
    free : uint8 (n,), padded.
    stride : length of a padded row.
    pad : width of the padding.
    x, y : int64 (k,): the vertices, padded.
    diagonals : see :func:`lampyris.kernels.graph.any_angle.follow`.
    turn_x, turn_y : int64 (k,): room.
    path : int32 (m,): room.
    turns : int32 (2 k,): x and y of the vertices at which the path turns, and of both ends.
    walk : int32 (2 m,): x and y of its cells.
    count : int64 (2,): how many of either; the second is less than 0 where there is not enough room: minus what is needed.
    """
    need = 1
    many = 0
    for k in range(len(x)):
        if k > 0:
            need += abs(x[u64(k)] - x[u64(k - 1)]) + abs(y[u64(k)] - y[u64(k - 1)])
        # A vertex on the line to the next is none; nor is one from which the path goes back (two trees that met share a line).
        while many > 1:
            ax = turn_x[u64(many - 1)] - turn_x[u64(many - 2)]
            ay = turn_y[u64(many - 1)] - turn_y[u64(many - 2)]
            if ax * (y[u64(k)] - turn_y[u64(many - 1)]) != ay * (x[u64(k)] - turn_x[u64(many - 1)]):
                break
            many -= 1
        if many > 0 and turn_x[u64(many - 1)] == x[u64(k)] and turn_y[u64(many - 1)] == y[u64(k)]:
            continue
        turn_x[u64(many)] = x[u64(k)]
        turn_y[u64(many)] = y[u64(k)]
        many += 1
    for k in range(many):
        turns[u64(2 * k)] = turn_x[u64(k)] - pad
        turns[u64(2 * k + 1)] = turn_y[u64(k)] - pad
    count[0] = many
    count[1] = -need
    if need > len(path):
        return
    steps = follow(free, stride, turn_x[:many], turn_y[:many], diagonals, path, halt)
    for k in range(steps):
        row = path[u64(k)] // stride
        walk[u64(2 * k)] = path[u64(k)] - row * stride - pad
        walk[u64(2 * k + 1)] = row - pad
    count[1] = steps
