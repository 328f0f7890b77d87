"""Random walkers alone for many ticks at once: the traffic of a world without anybody else in it."""

from __future__ import annotations

from lampyris.kernels._jit import kernel
from lampyris.kernels.adgso.simulate import BODIES, stroll


@kernel(out=("state", "where", "step_x", "step_y", "taken", "left", "gone", "tracks"))
def stroll_on(state, where, step_x, step_y, taken, left, gone, ways, stride, draws, per_tick, tracks):
    """As many ticks as there are draws for, ``per_tick`` each; ``tracks``: everybody's cell after each."""
    count = state[BODIES]
    for tick in range(len(draws) // per_tick):
        stroll(state, where, step_x, step_y, taken, left, gone, ways, stride, draws, tick * per_tick)
        for body in range(count):
            tracks[tick * count + body] = where[body]
