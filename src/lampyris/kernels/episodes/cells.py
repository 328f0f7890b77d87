"""One action of many episodes on cells."""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel

LCG = 48_271
LCG_MODULUS = 2_147_483_647
"""Lehmer's generator x -> 48271 x mod (2^31 - 1): in 64 bits in both forms. Park, Miller, Stockmeyer 1993."""


@kernel(inline=True)
def draw_task(i, generator, target, first):
    """Draw a goal and a start for episode i; returns the place of the start in the list of starts."""
    x = LCG * generator[i] % LCG_MODULUS
    goals = len(first) - 1
    target[i] = x * goals // LCG_MODULUS
    x = LCG * x % LCG_MODULUS
    generator[i] = x
    begin = first[target[i]]
    return begin + x * (first[target[i] + 1] - begin) // LCG_MODULUS


@kernel(inline=True)
def observe_cell(i, cell, goal, moved, wall, width, patch, seen):
    """Write what episode i observes: the patch row by row, the direction to the goal, its distance, whether it moved."""
    half = patch // 2
    k = i * (patch * patch + 4)
    for dy in range(patch):
        there = cell + (dy - half) * width - half
        for dx in range(patch):
            seen[k] = wall[there + dx]
            k += 1
    right = float(goal % width - cell % width)
    up = float(cell // width - goal // width)
    distance = sqrt(right * right + up * up)
    if distance > 0.0:
        seen[k] = right / distance
        seen[k + 1] = up / distance
    else:
        seen[k] = 0.0
        seen[k + 1] = 0.0
    seen[k + 2] = distance / (distance + 10.0)
    seen[k + 3] = moved


@kernel(
    out=(
        "cell", "target", "steps", "lost", "paid", "ended", "generator", "seen", "reward", "terminated",
        "truncated",
    ),
    each=20_000,
    of="action",
)  # fmt: skip
def step_cells(
    action, wall, to_go, weight, jump, side_a, side_b, costs, starts, first, goals, width, patch, unit, bump,
    shaped, discount, limit, cell, target, steps, lost, paid, ended, generator, seen, reward, terminated,
    truncated,
):  # fmt: skip
    """One action of each episode; one that has ended begins again instead. Returns how many steps were made.

    Parameters
    ----------
    action : int64 (n,): index of a step of ``jump``; -1: begin an episode.
    wall : float32 (size,): 1 where the robot's centre may not be. The map has a border of ``patch // 2`` such cells.
    to_go : int64 (goals * size,): exact cost to each goal, -1: none.
    weight : int64 (size,): by which the cost of entering each cell is multiplied.
    jump, side_a, side_b, costs : int64 (m,): each step as a difference of indices; the two cells that must be free
        beside it (0: none); its cost before ``weight``.
    starts : int64: starts of the first goal, then those of the second, ...; goal g has ``first[g]`` to ``first[g + 1]``.
    goals : int64: cell of each goal.
    width : of a row, with the border.
    patch : side of the observed patch, odd.
    unit : cost of a straight step on plain ground.
    bump : cost of an action that is no legal step: the robot stays.
    shaped : 1: rewards contain the difference of potentials.
    discount : of the potential.
    limit : steps of an episode.
    cell, target, steps, lost, paid, ended, generator : in and out, (n,): where it is, its goal, steps made, exact cost
        beyond the optimum, exact cost, whether it has ended, state of its generator.
    seen : out, float32 (n * (patch * patch + 4),).
    reward : out, float64 (n,).
    terminated, truncated : out, bool (n,).
    """
    size = len(wall)
    made = 0
    for i in range(len(action)):
        terminated[i] = False
        truncated[i] = False
        reward[i] = 0.0
        moved = 0.0
        if action[i] < 0 or ended[i] != 0:
            cell[i] = starts[draw_task(i, generator, target, first)]
            steps[i] = 0
            lost[i] = 0
            paid[i] = 0
            ended[i] = 0
        else:
            made += 1
            here = cell[i]
            k = action[i]
            there = here + jump[k]
            field = target[i] * size
            price = bump
            gone = bump
            if wall[there] == 0.0 and wall[here + side_a[k]] == 0.0 and wall[here + side_b[k]] == 0.0:
                price = costs[k] * weight[there]
                gone = price + to_go[field + there] - to_go[field + here]
                here = there
                cell[i] = there
                moved = 1.0
            paid[i] += price
            lost[i] += gone
            steps[i] += 1
            if shaped != 0:
                reward[i] = (1.0 - discount) * to_go[field + here] / unit - gone / unit
            else:
                reward[i] = -price / unit
            if here == goals[target[i]]:
                terminated[i] = True
                ended[i] = 1
            elif steps[i] >= limit:
                truncated[i] = True
                ended[i] = 1
        observe_cell(i, cell[i], goals[target[i]], moved, wall, width, patch, seen)
    return made
