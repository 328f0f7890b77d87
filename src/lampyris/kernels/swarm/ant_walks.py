"""Walks of ants over the steps of a map, all ants turn by turn."""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel, stopped, u64

RISE, COST, STEP, LINE = 0, 1, 2, 3
"""What leads ants; see :class:`lampyris.planning.swarm.mmas_dstar.Eta`."""
WALKING, TURN, USED, LOGGED = 0, 1, 2, 3
"""Indices into ``state``: ants still walking, turns made, draws used, steps logged."""


@kernel()
def _first_trail(trails, edge):
    """The place of the first trail that is not less than an edge."""
    low = 0
    high = len(trails)
    while low < high:
        middle = (low + high) >> 1
        if trails[u64(middle)] < edge:
            low = middle + 1
        else:
            high = middle
    return low


@kernel(out=("seen", "here", "walking", "sums", "weight", "log", "state"), of="draws", each=10_000)
def ant_walks(
    free, to_go, ground, price, heavy, jump, via, across, trails, tau, rest, guide, alpha, beta, unit,
    goal, goal_x, goal_y, stride, pad, longest, draws, seen, here, walking, sums, weight, log, state, halt,
):  # fmt: skip
    """Continue the walks of ants until all have ended, or until draws or room in the log run out.

    In each turn every ant that still walks takes one step with probability in proportion to ``tau^alpha eta^beta``, never
    to a cell where it has been; it ends at the goal, or where it may go nowhere. Sums and products are made in the order
    of :meth:`lampyris.planning.swarm.mmas_dstar.Ants.weights`, so that both are equal to the last bit.

    Parameters
    ----------
    free : bool (n,); to_go, ground : int64 (n,), exact cost to the goal and terrain (or empty) of each cell.
    price, heavy, jump, via, across : int64 (m,); of each step, see :attr:`SearchSpace.tables`.
    trails, tau : int64 and float64 (t,); ascending, edges (cell * m + step) whose pheromone is not ``rest``.
    guide : RISE, COST, STEP or LINE.
    alpha, beta : weights of pheromone and guide, whole.
    unit : cost of a straight step.
    goal, goal_x, goal_y : the goal as flat cell and as cell.
    stride, pad : cells in a row, width of the border.
    longest : turns at most.
    draws : float64, uniform in 0 <= u < 1, in the order in which ants ask.
    seen : bool (ants * n,); cells where each ant has been.
    here, walking : int64 (ants,); cells of all ants, numbers of those still walking.
    sums, weight : float64 (m,); scratch.
    log : int64 (4 * room,); of each step the cell that it begins at, the number of the step, the ant and the turn.
    state : int64 (4,); see WALKING.
    """
    many = len(jump)
    room = len(log) // 4
    cells = len(free)
    while state[WALKING] > 0 and state[TURN] < longest and not stopped(halt):
        count = state[WALKING] + 0
        if state[USED] + count > len(draws) or state[LOGGED] + count > room:
            break
        kept = 0
        for i in range(count):
            ant = walking[u64(i)] + 0
            at = here[u64(ant)] + 0
            edge = at * many
            trail = _first_trail(trails, edge)
            last = 0.0
            for k in range(many):
                to = at + jump[u64(k)]
                w = 0.0
                if (
                    free[u64(at)]
                    and free[u64(to)]
                    and free[u64(at + via[u64(k)])]
                    and free[u64(at + across[u64(k)])]
                    and not seen[u64(ant * cells + to)]
                ):
                    while trail < len(trails) and trails[u64(trail)] < edge + k:
                        trail += 1
                    strength = rest
                    if trail < len(trails) and trails[u64(trail)] == edge + k:
                        strength = tau[u64(trail)] + 0.0
                    if strength > 0.0:
                        paid = price[u64(k)] + 0
                        if len(ground) > 0:
                            paid += heavy[u64(k)] * ground[u64(to)]
                        if guide == RISE:
                            eta = 1.0 / (1.0 + (to_go[u64(to)] + paid - to_go[u64(at)]) / unit)
                        elif guide == COST:
                            eta = 1.0 / (1.0 + to_go[u64(to)] / unit)
                        elif guide == STEP:
                            eta = unit / paid
                        else:
                            row = to // stride
                            dx = float(to - row * stride - pad - goal_x)
                            dy = float(row - pad - goal_y)
                            eta = 1.0 / (1.0 + sqrt(dx * dx + dy * dy))
                        w = 1.0
                        for _ in range(alpha):
                            w *= strength
                        for _ in range(beta):
                            w *= eta
                weight[u64(k)] = w
                last += w
                sums[u64(k)] = last
            # As :func:`lampyris.planning.swarm.optimisers.glowworm.roulette`: a draw that rounding raises to the last
            # sum stays below it.
            threshold = draws[u64(state[USED] + i)] * last
            step = 0
            while step < many - 1 and not (
                sums[u64(step)] > threshold or (threshold >= last and sums[u64(step)] >= last)
            ):
                step += 1
            if not weight[u64(step)] > 0.0:
                continue
            to = at + jump[u64(step)]
            place = state[LOGGED] + 0
            log[u64(place)] = at
            log[u64(room + place)] = step
            log[u64(2 * room + place)] = ant
            log[u64(3 * room + place)] = state[TURN]
            state[LOGGED] = place + 1
            here[u64(ant)] = to
            seen[u64(ant * cells + to)] = True
            if to != goal:
                walking[u64(kept)] = ant
                kept += 1
        state[USED] += count
        state[TURN] += 1
        state[WALKING] = kept
