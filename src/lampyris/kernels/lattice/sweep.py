"""Cells that a polygon touches while it moves."""

from __future__ import annotations

from math import ceil, floor

from lampyris.kernels._jit import kernel, u64


@kernel(out=("touched",), inline=True)
def _edge(touched, width, height, ax, ay, bx, by, margin):
    """Mark the cells within ``margin``, along each axis, of the segment between two points."""
    if ax > bx:
        ax, ay, bx, by = bx, by, ax, ay
    # Cell x covers x - 0.5 to x + 0.5, widened by the margin; a square that only touches does not count.
    half = 0.5 + margin
    x = max(floor(ax - half) + 1, 0)
    last = min(ceil(bx + half) - 1, width - 1)
    while x <= last:
        # The part of the segment in this column.
        left = max(ax, x - half)
        right = min(bx, x + half)
        if bx > ax:
            y0 = ay + (by - ay) * ((left - ax) / (bx - ax))
            y1 = ay + (by - ay) * ((right - ax) / (bx - ax))
        else:
            y0 = ay
            y1 = by
        if y0 > y1:
            y0, y1 = y1, y0
        y = max(floor(y0 - half) + 1, 0)
        bottom = min(ceil(y1 + half) - 1, height - 1)
        while y <= bottom:
            touched[u64(y * width + x)] = 1
            y += 1
        x += 1


@kernel(out=("touched",), each=1000)
def sweep(px, py, pose_x, pose_y, pose_cos, pose_sin, margin, touched, width, height):
    """Mark the cells that the edges of a polygon touch at any of its poses, and those inside it at the first.

    Parameters
    ----------
    px, py : float64 (k,): vertices in the frame of the polygon, cells; y points down, as rows do.
    pose_x, pose_y, pose_cos, pose_sin : float64 (n,): where its frame is, in cells of the window.
    margin : distance within which a cell counts as touched, in cells.
    touched : uint8 (height * width,): the window, all 0.
    width, height : of the window.
    """
    k = len(px)
    for n in range(len(pose_x)):
        c = pose_cos[u64(n)]
        s = pose_sin[u64(n)]
        x0 = pose_x[u64(n)]
        y0 = pose_y[u64(n)]
        j = k - 1
        ax = x0 + c * px[u64(j)] - s * py[u64(j)]
        ay = y0 + s * px[u64(j)] + c * py[u64(j)]
        for i in range(k):
            bx = x0 + c * px[u64(i)] - s * py[u64(i)]
            by = y0 + s * px[u64(i)] + c * py[u64(i)]
            _edge(touched, width, height, ax, ay, bx, by, margin)
            ax = bx
            ay = by
    # The inside at the first pose: centres, by the parity of crossings to the left.
    c = pose_cos[u64(0)]
    s = pose_sin[u64(0)]
    x0 = pose_x[u64(0)]
    y0 = pose_y[u64(0)]
    left = width - 1
    right = 0
    top = height - 1
    bottom = 0
    for i in range(k):
        ax = x0 + c * px[u64(i)] - s * py[u64(i)]
        ay = y0 + s * px[u64(i)] + c * py[u64(i)]
        left = min(left, max(floor(ax), 0))
        right = max(right, min(ceil(ax), width - 1))
        top = min(top, max(floor(ay), 0))
        bottom = max(bottom, min(ceil(ay), height - 1))
    for y in range(top, bottom + 1):
        for x in range(left, right + 1):
            inside = 0
            j = k - 1
            for i in range(k):
                ax = x0 + c * px[u64(j)] - s * py[u64(j)]
                ay = y0 + s * px[u64(j)] + c * py[u64(j)]
                bx = x0 + c * px[u64(i)] - s * py[u64(i)]
                by = y0 + s * px[u64(i)] + c * py[u64(i)]
                if (ay > y) != (by > y) and x < ax + (bx - ax) * ((y - ay) / (by - ay)):
                    inside = 1 - inside
                j = i
            if inside == 1:
                touched[u64(y * width + x)] = 1
