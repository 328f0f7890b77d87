"""How near the nearest wall is, around a few cells: rings outward, until no farther ring can be nearer.

A whole distance map answers the same question for every cell; a path asks it of some tens of cells, within
a reach beyond which no wall could slow the robot, so looking around each of them is less work and keeps
nothing.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64


@kernel(out=("squared",))
def nearest_squares(wall, width, height, xs, ys, rings, squared):
    """Squared distance from the centre of each cell to the nearest wall square, in half cells.

    Parameters
    ----------
    wall : bool (height * width,), row by row; what lies outside is not a wall.
    width, height : its size.
    xs, ys : int64 (n,), cells within it.
    rings : how many Chebyshev rings to look at.
    squared : out, int64 (n,). Given: what to say where those rings hold no wall. 0 in a wall.

    A square k columns and j <= k rows away is max(2k - 1, 0) and max(2j - 1, 0) half cells away in the two
    axes, so within a ring the first hit in rising j is the nearest, and ring k has nothing nearer than 2k -
    1.
    """
    for i in range(len(xs)):
        x = xs[i]
        y = ys[i]
        if wall[u64(y * width + x)]:
            squared[i] = 0
            continue
        best = squared[i]
        for k in range(1, rings + 1):
            flat = (2 * k - 1) * (2 * k - 1)
            if flat >= best:
                break
            up = (y - k) * width
            down = (y + k) * width
            for j in range(k + 1):
                d = flat
                if j > 0:
                    d += (2 * j - 1) * (2 * j - 1)
                if d >= best:
                    break
                hit = False
                if x >= j:
                    hit = (y >= k and wall[u64(up + x - j)]) or (y + k < height and wall[u64(down + x - j)])
                if not hit and x + j < width:
                    hit = (y >= k and wall[u64(up + x + j)]) or (y + k < height and wall[u64(down + x + j)])
                if not hit and y >= j:
                    row = (y - j) * width + x
                    hit = (x >= k and wall[u64(row - k)]) or (x + k < width and wall[u64(row + k)])
                if not hit and y + j < height:
                    row = (y + j) * width + x
                    hit = (x >= k and wall[u64(row - k)]) or (x + k < width and wall[u64(row + k)])
                if hit:
                    best = d
                    break
        squared[i] = best
