"""Collisions of a planar chain of rectangular links with blocked cells and with itself.

Lengths are in cells and the frame is the grid's (y down). A motion is the straight line between two
configurations. It is looked at in pieces: if every point of the chain moves at most ``m`` between the middle of a
piece and anywhere in it, links that are ``2 m`` wider on each side at the middle and free there prove the whole
piece free, with ``m`` to spare. So nothing is missed between two looks.
"""

from __future__ import annotations

from math import floor

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.curves.angles import sine_cosine

SPARE = 1e-9
LOOK = 256
"""Configurations between two looks at the flag that stops the search."""


@kernel(out=("place",))
def _lay(chain, links, q, at, other, t, place):
    """Where the links are at the fraction t from one configuration to another: middle and direction of each."""
    n = len(links) // 2
    x = chain[0]
    y = chain[1]
    angle = -chain[2]
    for k in range(n):
        angle += q[at + k] + t * (q[other + k] - q[at + k])
        s, c = sine_cosine(angle)
        half = 0.5 * links[2 * k]
        place[4 * k] = x + half * c
        place[4 * k + 1] = y - half * s
        place[4 * k + 2] = c
        place[4 * k + 3] = -s
        x += 2.0 * half * c
        y -= 2.0 * half * s


@kernel()
def _meets_wall(blocked, sums, width, height, cx, cy, ux, uy, a, b):
    """Whether a rectangle meets a blocked cell, or leaves the map."""
    wide = a * abs(ux) + b * abs(uy)
    high = a * abs(uy) + b * abs(ux)
    if cx - wide < -0.5 or cx + wide > width - 0.5 or cy - high < -0.5 or cy + high > height - 0.5:
        return True
    left = max(0, floor(cx - wide + 0.5))
    right = min(width - 1, floor(cx + wide + 0.5))
    top = max(0, floor(cy - high + 0.5))
    low = min(height - 1, floor(cy + high + 0.5))
    row = width + 1
    walls = (
        sums[u64((low + 1) * row + right + 1)]
        - sums[u64(top * row + right + 1)]
        - sums[u64((low + 1) * row + left)]
        + sums[u64(top * row + left)]
    )
    if walls == 0:
        return False
    reach = 0.5 * (abs(ux) + abs(uy))
    for y in range(top, low + 1):
        for x in range(left, right + 1):
            if blocked[u64(y * width + x)] == 0:
                continue
            dx = x - cx
            dy = y - cy
            if (
                abs(dx) < 0.5 + wide
                and abs(dy) < 0.5 + high
                and abs(dx * ux + dy * uy) < a + reach
                and abs(dy * ux - dx * uy) < b + reach
            ):
                return True
    return False


@kernel()
def _meet(place, links, i, j, more):
    """Whether two links, each ``more`` larger on all sides, overlap."""
    dx = place[4 * j] - place[4 * i]
    dy = place[4 * j + 1] - place[4 * i + 1]
    cos = abs(place[4 * i + 2] * place[4 * j + 2] + place[4 * i + 3] * place[4 * j + 3])
    sin = abs(place[4 * i + 2] * place[4 * j + 3] - place[4 * i + 3] * place[4 * j + 2])
    a = 0.5 * links[2 * i] + more
    b = 0.5 * links[2 * i + 1] + more
    c = 0.5 * links[2 * j] + more
    d = 0.5 * links[2 * j + 1] + more
    return (
        abs(dx * place[4 * i + 2] + dy * place[4 * i + 3]) < a + c * cos + d * sin
        and abs(dy * place[4 * i + 2] - dx * place[4 * i + 3]) < b + c * sin + d * cos
        and abs(dx * place[4 * j + 2] + dy * place[4 * j + 3]) < c + a * cos + b * sin
        and abs(dy * place[4 * j + 2] - dx * place[4 * j + 3]) < d + a * sin + b * cos
    )


@kernel(out=("place",))
def struck(blocked, sums, width, height, chain, links, place, more):
    """The first link, from the base on, that meets a wall or a link before the one before it; -1: none."""
    for k in range(len(links) // 2):
        if _meets_wall(
            blocked, sums, width, height, place[4 * k], place[4 * k + 1], place[4 * k + 2], place[4 * k + 3],
            0.5 * links[2 * k] + more, 0.5 * links[2 * k + 1] + more,
        ):  # fmt: skip
            return k
        for j in range(k - 1):
            if _meet(place, links, j, k, more):
                return k
    return -1


@kernel(out=("place", "counts"), each=2_000_000, of="links")
def motion_hit(blocked, sums, width, height, chain, links, lever, reach, q, at, other, place, counts, halt):
    """The link that first collides on the way from one configuration to another; -1: the motion is free.

    A check that is stopped answers with a link, so that no motion counts as free that was not looked at.

    Parameters
    ----------
    blocked : uint8 (height * width,); sums : int64 ((height + 1) * (width + 1),), how many cells above and to the
        left of each corner are blocked.
    chain : float64 (3,): base x, y in cells; the yaw of the grid.
    links : float64 (2 n,): length and width of each link, cells.
    lever : float64 (n,): how far the farthest point of the chain can be from each joint.
    reach : greatest movement of a point within a piece, cells.
    q : float64; configurations one after the other; ``at`` and ``other`` are where two of them begin.
    place : float64 (4 n,); scratch.
    counts : int64 (k,); the first is raised by one for each configuration looked at.
    """
    moved = 0.0
    for k in range(len(lever)):
        moved += abs(q[other + k] - q[at + k]) * lever[k]
    pieces = 1 + floor(moved / reach)
    more = moved / pieces + SPARE
    # The far end first: motions that fail, fail there most often.
    for i in range(pieces):
        if i % LOOK == LOOK - 1 and stopped(halt):
            return 0
        t = 1.0 - (i + 0.5) / pieces
        _lay(chain, links, q, at, other, t, place)
        counts[0] += 1
        hit = struck(blocked, sums, width, height, chain, links, place, more)
        if hit >= 0:
            return hit
    return -1
