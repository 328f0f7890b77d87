"""Rapidly exploring random trees of configurations of a chain, whose space may grow joint by joint.

RRT: LaValle, "Rapidly-exploring random trees", 1998. RRT-Connect: Kuffner, LaValle, ICRA 2000, 995-1001. Growing
spaces: Xanthidis et al., "Motion planning by sampling in subspaces of progressively increasing dimension", JINT
2020. Which joint comes next, and that the trees are kept, is ours.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.chain.collision import motion_hit

# Places in ``state``.
CHECKS, NODES, SAMPLES, FAILED, SINCE, RELEASED, FROM_START, FROM_GOAL = 0, 1, 2, 3, 4, 5, 6, 7


@kernel()
def _nearest(q, side, count, n, lever, which, target):
    """The node of a tree that is nearest to a configuration, joints weighed by their levers."""
    best = -1.0
    found = -1
    for i in range(count):
        if side[u64(i)] != which:
            continue
        total = 0.0
        for k in range(n):
            d = (q[u64(i * n + k)] - q[u64(target + k)]) * lever[u64(k)]
            total += d * d
            if best >= 0.0 and total >= best:
                break
        if best < 0.0 or total < best:
            best = total
            found = i
    return found


@kernel(out=("q", "side", "parent", "place", "hits", "state"))
def _extend(
    blocked, sums, width, height, chain, links, lever, reach, stride, q, side, parent, place, hits, state,
    near, target, spare, which, halt,
):  # fmt: skip
    """Go from a node towards a configuration by ``stride`` at most; the new node, or -1 if the motion collides.

    ``target`` and ``spare`` are places in q; the node's number is written there when it is made.
    """
    n = len(lever)
    far = 0.0
    for k in range(n):
        d = (q[target + k] - q[near * n + k]) * lever[k]
        far += d * d
    far = sqrt(far)
    share = 1.0 if far <= stride else stride / far
    for k in range(n):
        here = q[near * n + k]
        q[spare + k] = q[target + k] if share == 1.0 else here + share * (q[target + k] - here)
    hit = motion_hit(
        blocked, sums, width, height, chain, links, lever, reach, q, near * n, spare, place, state, halt
    )
    if hit >= 0:
        hits[hit] += 1
        return -1
    new = int(state[1])
    for k in range(n):
        q[new * n + k] = q[spare + k]
    side[new] = which
    parent[new] = near
    state[1] = new + 1
    return new


@kernel(out=("free", "order", "state"))
def _release(free, hits, order, state):
    """Release the joint of the link that has collided most often; of equals, the one that moves most collisions."""
    n = len(free)
    best = -1
    beyond = 0
    best_beyond = 0
    for k in range(n - 1, -1, -1):
        beyond += hits[k]
        if free[k] != 0:
            continue
        if best < 0 or hits[k] > hits[best] or (hits[k] == hits[best] and beyond >= best_beyond):
            best = k
            best_beyond = beyond
    if best >= 0:
        free[best] = 1
        order[state[5]] = best
        state[5] += 1
    state[3] = 0
    state[4] = 0


@kernel(out=("free", "order", "q", "side", "parent", "place", "hits", "state"), each=20_000)
def grow(
    blocked, sums, width, height, chain, links, lever, low, high, reach, stride, draws, both, adaptive, patience, bias,
    free, order, q, side, parent, place, hits, state, halt,
):  # fmt: skip
    """Grow trees by one batch of samples; 1: start and goal are joined.

    Parameters
    ----------
    blocked .. lever, reach : see :func:`lampyris.kernels.chain.collision.motion_hit`.
    low, high : float64 (n,): limits of the joints.
    stride : greatest distance of an extension: root of the sum of squared angles, each times its lever; cells.
    draws : float64 (m * (n + 2),), in [0, 1): one row for each sample.
    both : 1: a tree from either end, each grown towards the other (RRT-Connect); 0: one tree from the start.
    adaptive : 1: joints that are not released stay on the line from start to goal.
    patience : extensions that collide before the first joint is released, twice as many before the second, and so on;
        ten times as many samples suffice, too.
    bias : share of samples that are the goal, where there is one tree.
    free : uint8 (n,), 1 for each joint released; order : int64 (n,), in which order.
    q : float64 (capacity * n,): node 0 the start, node 1 the goal; the last two are scratch.
    side : int8 (capacity,): the tree of a node; parent : int32 (capacity,).
    hits : int64 (n,): collisions of each link.
    state : int64 (8,): see above.
    """
    n = len(lever)
    capacity = len(side) - 2
    sample = capacity * n
    spare = sample + n
    for m in range(len(draws) // (n + 2)):
        if state[1] + 1 >= capacity or stopped(halt):
            return 0
        row = m * (n + 2)
        which = int(state[2] % 2) if both == 1 else 0
        state[2] += 1
        state[4] += 1
        wait = patience * (1 + state[5])
        if adaptive == 1 and state[5] < n and (state[3] >= wait or state[4] >= 10 * wait):
            _release(free, hits, order, state)
        to_goal = both == 0 and draws[row + n + 1] < bias
        share = draws[row + n]
        for k in range(n):
            if to_goal:
                q[sample + k] = q[n + k]
            elif adaptive == 1 and free[k] == 0:
                q[sample + k] = q[k] + share * (q[n + k] - q[k])
            else:
                q[sample + k] = low[k] + draws[row + k] * (high[k] - low[k])
        near = _nearest(q, side, state[1], n, lever, which, sample)
        new = _extend(
            blocked, sums, width, height, chain, links, lever, reach, stride, q, side, parent, place, hits, state,
            near, sample, spare, which, halt,
        )  # fmt: skip
        if new < 0:
            state[3] += 1
            continue
        # The other tree goes all the way to the new node, or the new node looks for the goal.
        if both == 1:
            at = _nearest(q, side, state[1], n, lever, 1 - which, new * n)
        else:
            at = new
        goal = new * n if both == 1 else n
        while state[1] + 1 < capacity:
            gap = 0.0
            for k in range(n):
                d = (q[goal + k] - q[at * n + k]) * lever[k]
                gap += d * d
            if both == 0 and gap > stride * stride:
                break
            last = at
            if gap > 0.0:
                last = _extend(
                    blocked, sums, width, height, chain, links, lever, reach, stride, q, side, parent, place, hits,
                    state, at, goal, spare, 1 - which if both == 1 else 0, halt,
                )  # fmt: skip
                if last < 0:
                    break
            if gap <= stride * stride:
                state[6] = new if which == 0 and both == 1 else last
                state[7] = last if which == 0 and both == 1 else (new if both == 1 else 1)
                return 1
            at = last
    return 0
