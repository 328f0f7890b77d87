"""Random walkers alone for many ticks at once: the traffic of a world without any other traffic."""

from __future__ import annotations

from lampyris.kernels._jit import kernel
from lampyris.kernels.adgso.simulate import OBSTACLES, stroll


@kernel(out=("state", "where", "step_x", "step_y", "taken", "left", "gone", "tracks"))
def stroll_on(state, where, step_x, step_y, taken, left, gone, open_steps, stride, draws, per_tick, tracks):
    """As many ticks as there are draws for, ``per_tick`` each; ``tracks``: the cells of all obstacles after each."""
    count = state[OBSTACLES]
    for tick in range(len(draws) // per_tick):
        stroll(state, where, step_x, step_y, taken, left, gone, open_steps, stride, draws, tick * per_tick)
        for obstacle in range(count):
            tracks[tick * count + obstacle] = where[obstacle]
