"""Random walkers of one cell with nobody else about, many ticks in one call.

By the kernel of compiled ticks, without the dictionaries of :mod:`lampyris.sim.traffic.traffic`: 20 walkers on 50 x 50
cells take 1.4 us a tick here and 150 us there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.simulation import ticks as k
from lampyris.model.grid import frozen
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.sim.traffic.obstacle_draws import steps
from lampyris.sim.traffic.traffic import Traffic


def alone(scene: Scene) -> bool:
    """Whether random walkers of one cell, all there from the start, are all that moves in a scene."""
    if len(scene.traffic) != 1:
        return False
    spec = scene.traffic[0]
    return isinstance(spec, RandomWalk) and spec.rate is None and spec.radius == 0 and spec.count > 0


class RandomWalkers:
    """The walkers of traffic that has just been opened; only this moves them from here on.

    Parameters
    ----------
    traffic : of a scene in which they are :func:`alone`.
    """

    def __init__(self, traffic: Traffic) -> None:
        world, walkers = traffic.world, traffic.walkers[0]
        self._key, count, space = walkers.key, len(world.where), world.space
        room = (space.height + 2) * space.stride
        st = self._st = np.zeros(k.STATE, dtype=np.int64)
        st[[k.OBSTACLES, k.CAPACITY, k.PER_TICK, k.WALKERS]] = count, count, count + 2, 1
        st[[k.ROBOT, k.STRIDE, k.HEIGHT, k.ROOM]] = world.robot, space.stride, space.height, room
        where = np.array(world.where, dtype=np.int64)
        step_x, step_y, gone = np.zeros((3, count), dtype=np.int64)
        taken, left = np.zeros((2, room), dtype=np.int32)
        taken[where] = np.arange(1, count + 1)
        self._obstacles = where, step_x, step_y, taken, left, gone
        row = np.array((0, 0, count, count, 0), dtype=np.int64)
        own = np.array(walkers.own, dtype=np.int64)
        none = np.zeros(1, dtype=np.int64)
        nowhere = frozen(np.zeros(1, dtype=np.uint8))  # nobody appears
        self._rules = row, own, np.array([-1.0]), nowhere, walkers.shape.step_bits(), none, none, none, none
        self._events = none

    def go(self, ticks: int) -> NDArray[np.int64]:
        """So many ticks more: the number of each walker's cell after each; (ticks, walkers)."""
        st = self._st
        count, now = int(st[k.OBSTACLES]), int(st[k.NOW])
        tracks = np.zeros(ticks * count, dtype=np.int64)
        st[[k.STOP_AT, k.DRAWN_FROM, k.BASE]] = now + ticks, now + 1, now + 1
        draws = steps(self._key, count, now + 1, ticks).ravel()
        k.move_on(st, *self._obstacles, draws, *self._rules, tracks, self._events)
        return tracks.reshape(ticks, -1)
