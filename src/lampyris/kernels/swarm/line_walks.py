"""Sums over walks of straight legs, step by step."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64


@kernel(out=("sums",), of="at", each=300_000)
def walk_sums(
    free, near, ground, price, heavy, jump, via, across, turn, at, kinds, counts, legs, sums, halt
):  # fmt: skip
    """What the steps of each walk add up to.

    Parameters
    ----------
    free : bool (n,); nearness ``near`` and terrain ``ground`` int64 (n,); of each cell.
    price, heavy : int64 (m,); what a step costs on plain ground, and for each unit of terrain where it ends.
    jump, via, across : int64 (m,); from the cell that a step leaves to its end and to the cells beside it.
    turn : int64 (m * m,); the change of direction between two steps.
    at : int64 (k,); the cell that each leg leaves.
    kinds, counts : int64 (2 k,); the two steps of each leg, and how many of each.
    legs : of a walk.
    sums : int64 (5 w,); for each walk length, terrain, steps that may not be made, nearness, turns.
    """
    size = len(price)
    for walk in range(len(at) // legs):
        if stopped(halt):
            break
        length = 0
        extra = 0
        shut = 0
        beside = 0
        turned = 0
        before = -1
        for leg in range(walk * legs, walk * legs + legs):
            second = counts[u64(2 * leg + 1)]
            total = counts[u64(2 * leg)] + second
            half = total // 2
            here = at[u64(leg)] + 0
            taken = half
            for _ in range(total):
                # As Bresenham spreads them: the second kind where its share passes a whole number.
                taken += second
                step = kinds[u64(2 * leg)] + 0
                if taken >= total:
                    taken -= total
                    step = kinds[u64(2 * leg + 1)] + 0
                to = here + jump[u64(step)]
                if not (
                    free[u64(here)] and free[u64(to)] and free[u64(here + via[u64(step)])] and free[u64(here + across[u64(step)])]
                ):  # fmt: skip
                    shut += 1
                length += price[u64(step)]
                if len(ground) > 0:
                    extra += heavy[u64(step)] * ground[u64(to)]
                if len(near) > 0:
                    beside += near[u64(to)]
                if before >= 0:
                    turned += turn[u64(before * size + step)]
                before = step
                here = to
        sums[u64(5 * walk)] = length
        sums[u64(5 * walk + 1)] = extra
        sums[u64(5 * walk + 2)] = shut
        sums[u64(5 * walk + 3)] = beside
        sums[u64(5 * walk + 4)] = turned
