"""Draws of random walkers: the numbers of :mod:`lampyris.sim.traffic.obstacle_draws`, many at once.

Words have 64 bits. The plain form cuts them off; in the compiled form that does nothing.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.simulation.obstacle_rules import rank

PLACE, STEPS, APPEAR, ROUTE = 0, 1, 2, 3
"""What is drawn."""
TRIES = 64
"""Cells drawn at random before all cells that are left are looked at."""
GOLDEN = 0x9E3779B97F4A7C15
FIRST_FACTOR, SECOND_FACTOR = 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
"""Of SplitMix64's mixing."""
UNIT = 1.0 / (1 << 53)
_ALL = (1 << 64) - 1


@kernel()
def mixed(z):
    """SplitMix64's mixing of one word."""
    z = ((z ^ (z >> u64(30))) * u64(FIRST_FACTOR)) & u64(_ALL)
    z = ((z ^ (z >> u64(27))) * u64(SECOND_FACTOR)) & u64(_ALL)
    return z ^ (z >> u64(31))


@kernel()
def draw(key, who, count):
    """A number in [0, 1): the ``count``-th of a sequence. All three are unsigned words."""
    begin = mixed((key + who * u64(GOLDEN)) & u64(_ALL))
    word = mixed((begin + (count + u64(1)) * u64(GOLDEN)) & u64(_ALL))
    return float(word >> u64(11)) * UNIT


@kernel(out=("draws",), each=3000, of="draws")
def draw_steps(keys, counts, first, ticks, draws):
    """What walkers draw in some ticks: tick by tick, for each specification a number a walker, and two for appearing.

    Parameters
    ----------
    keys, counts : uint64 and int64, by specification: its key and how many walkers it has.
    first, ticks : the first tick, and how many.
    draws : out, float64.
    """
    at = 0
    for tick in range(first, first + ticks):
        for k in range(len(counts)):
            for own in range(counts[k]):
                draws[at] = draw(keys[k], u64(4 * own + STEPS), u64(tick))
                at += 1
            for own in range(2):
                draws[at] = draw(keys[k], u64(4 * own + APPEAR), u64(tick))
                at += 1


@kernel(out=("opened", "found"), each=20_000, of="found")
def place(keys, first, width, height, opened, found):
    """A cell for each of some walkers of one cell, drawn uniformly among those that are open when it is its turn.

    Parameters
    ----------
    keys : uint64 (1,), the key of their specification.
    first : the number of the first walker.
    width, height : of the map, without its border one cell wide.
    opened : in and out, uint8 by cell number: where one may be put.
    found : out, int64: their cells.

    Returns
    -------
    How many have one; fewer than asked for where no cell is left.
    """
    cells = float(width * height)
    for k in range(len(found)):
        who = u64(4 * (first + k) + PLACE)
        number = -1
        for turn in range(TRIES):
            at = int(draw(keys[0], who, u64(turn)) * cells)
            y = at // width
            there = (y + 1) * (width + 2) + at - y * width + 1
            if opened[there] != 0:
                number = there
                break
        if number < 0:
            least = 0
            salt = int(draw(keys[0], who, u64(TRIES)) * 2147483648.0)
            for there in range((height + 2) * (width + 2)):
                if opened[there] != 0:
                    mine = rank(there, salt)
                    if number < 0 or mine < least:
                        number = there
                        least = mine
            if number < 0:
                return k
        opened[number] = 0
        found[k] = number
    return len(found)
