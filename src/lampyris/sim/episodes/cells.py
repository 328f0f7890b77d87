"""Episodes on cells, many at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.episodes.cells import step_cells
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.settings.episodes import CellEpisodeSettings
from lampyris.sim.episodes.tasks import BorderedTasks, Tasks, bordered, generators

NEVER = 2**40
"""Steps of an episode without a limit."""


class CellEpisodes:
    """``n`` robots on one map, each in an episode of its own: an action moves a robot to a neighbouring cell or leaves it.

    Parameters
    ----------
    tasks : where episodes begin and end.
    n : how many.
    settings : of observations and rewards.
    limit : steps after which an episode is cut off; None: never.
    """

    def __init__(self, tasks: Tasks, n: int, settings: CellEpisodeSettings, limit: int | None = None) -> None:
        self.tasks, self.n, self.settings = tasks, n, settings
        moves, grid = tasks.moves, tasks.scene.grid
        border = max(settings.patch // 2, 1)
        self.map = BorderedTasks.of(tasks, border)
        width = self.map.width
        scale = TERRAIN_UNIT if moves.scale == TERRAIN_UNIT else 1
        weight = np.full(grid.blocked.shape, scale, dtype=np.int64)
        if grid.terrain is not None:
            weight += grid.terrain
        jump = [dy * width + dx for dx, dy in moves.offsets]
        beside = [dx and dy and not moves.corner_cutting for dx, dy in moves.offsets]
        sides = [
            [dx if cuts else 0 for (dx, _), cuts in zip(moves.offsets, beside, strict=True)],
            [dy * width if cuts else 0 for (_, dy), cuts in zip(moves.offsets, beside, strict=True)],
        ]
        to_go = [bordered(f.exact.astype(np.int64), border, -1) for f in tasks.fields]
        self._map: tuple[Any, ...] = (
            self.map.shut, np.concatenate(to_go), bordered(weight, border, scale),
            *(np.array(one, dtype=np.int64) for one in (jump, *sides, [c // scale for c in moves.costs])),
            self.map.starts, self.map.first, self.map.goals, width, settings.patch, float(moves.unit),
            settings.bump_cost * moves.unit, int(settings.shaped), settings.discount,
            NEVER if limit is None else limit,
        )  # fmt: skip
        self.cell, self.target, self.steps, self.lost, self.paid, self.ended = (
            np.zeros(n, dtype=np.int64) for _ in range(6)
        )
        self._generator = np.ones(n, dtype=np.int64)
        self._begin = np.full(n, -1, dtype=np.int64)

    @property
    def actions(self) -> int:
        """How many actions there are: steps of the moves, in their order."""
        return len(self.tasks.moves.offsets)

    @property
    def observed(self) -> int:
        """Numbers of an observation."""
        return self.settings.patch * self.settings.patch + 4

    def seed(self, seeds: NDArray[np.uint64]) -> None:
        """Seed what is drawn, one seed for each episode."""
        self._generator = generators(seeds)

    def begin(self) -> NDArray[np.float32]:
        """Begin all episodes; float32 (n, :attr:`observed`)."""
        seen: NDArray[np.float32] = self.step(self._begin)[0]
        return seen

    def step(
        self, action: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """One action of each, int64 (n,): observations, rewards (cells), what arrived, what was cut off.

        Of an episode that has ended the next one begins, whatever the action; -1 begins one at any time.
        """
        n = self.n
        seen = np.empty(n * self.observed, dtype=np.float32)
        reward = np.empty(n)
        arrived, late = np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
        step_cells(
            action, *self._map, self.cell, self.target, self.steps, self.lost, self.paid, self.ended,
            self._generator, seen, reward, arrived, late,
        )  # fmt: skip
        return seen.reshape(n, self.observed), reward, arrived, late

    @property
    def regret(self) -> NDArray[np.float64]:
        """Cost so far and the optimal cost from here, less the optimal cost from the start; cells, exact if 0."""
        return self.lost / self.tasks.moves.unit

    @property
    def cost(self) -> NDArray[np.float64]:
        """Cost so far, cells."""
        return self.tasks.moves.values(self.paid)

    def where(self) -> NDArray[np.int64]:
        """Cells (x, y) of the robots; int64 (n, 2)."""
        return self.map.cells(self.cell)

    def best_actions(self) -> NDArray[np.int64]:
        """An optimal action of each, by the field; int64 (n,), 0 at the goal."""
        x, y = self.where().T
        step = np.stack([f.step for f in self.tasks.fields])[self.target, y, x]
        best: NDArray[np.int64] = np.maximum(step, 0).astype(np.int64)
        return best
