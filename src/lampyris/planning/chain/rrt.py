"""Trees of configurations of a chain: RRT, RRT-Connect, and RRT whose space grows joint by joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled
from lampyris._core.settings import check_settings, number, under_name, whole
from lampyris.kernels.chain.collision import motion_hit
from lampyris.kernels.chain.trees import grow
from lampyris.model.chain.chain import Chain
from lampyris.model.chain.chain_plan import ChainPlan
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.planning.base import Budget
from lampyris.typing import Floats

PLANNERS = ("rrt-adaptive", "rrt", "rrt-connect")
SAMPLES = 20_000
"""Samples drawn at most where no budget says how many."""
_NODES = 100_000
"""Configurations in the trees at most."""
_BATCH = 250


@dataclass(frozen=True, slots=True)
class RrtSettings:
    """Settings of the planners of chains.

    Parameters
    ----------
    stride : greatest length of one extension, as a share of the outstretched chain. Lengths of motions are the root of
        the sum of squares of each joint's turn times its distance to the farthest tip.
    piece : how far a point of the chain may move between two looks at a motion, cells; links are that much wider on
        each side when they are looked at, so smaller pieces pass narrower gaps and take longer.
    patience : of ``rrt-adaptive``: extensions that collide before the first joint is released, twice as many before
        the second, and so on; or ten times as many samples of any kind.
    bias : of ``rrt``: share of the samples that are the goal.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    stride: float = number(0.25, 0.001, 10.0)
    piece: float = number(0.1, 0.001, 1.0, unit="cells")
    patience: int = whole(25, 1, 1_000_000)
    bias: float = number(0.1, 0.0, 0.9)

    def __post_init__(self) -> None:
        check_settings(self, under_name("chain"))


class ChainSearch:
    """Trees for one chain on one map."""

    def __init__(self, grid: Grid, chain: Chain, settings: RrtSettings) -> None:
        self._chain, self._settings = chain, settings
        cell = grid.resolution
        height, width = grid.blocked.shape
        blocked = np.ascontiguousarray(grid.blocked).view(np.uint8)
        sums = np.zeros((height + 1, width + 1), dtype=np.int64)
        sums[1:, 1:] = blocked.cumsum(axis=0, dtype=np.int64).cumsum(axis=1)
        base = grid.to_points(*chain.base)
        links = np.array([chain.links, chain.widths]).T / cell
        half = float(links[:, 1].max()) / 2.0
        # The far corners of a link are off its axis by half its width.
        self._lever = np.cumsum(links[::-1, 0])[::-1] + half
        pose = np.array([float(base[0]), float(base[1]), float(grid.origin[2])])
        self._world = (
            blocked.ravel(),
            sums.ravel(),
            width,
            height,
            pose,
            np.ascontiguousarray(links).ravel(),
        )
        self._place = np.zeros(4 * chain.joints)

    def collides(self, q: Floats) -> bool:
        """Whether one configuration is not free."""
        return not self.is_free(np.stack((q, q)), 0, 1, np.zeros(1, dtype=np.int64))

    def is_free(self, rows: Floats, i: int, j: int, counts: NDArray[np.int64]) -> bool:
        """Whether the motion between two configurations, rows of (m, joints), is free."""
        n = self._chain.joints
        hit = motion_hit(
            *self._world,
            self._lever,
            self._settings.piece,
            rows.reshape(-1),
            i * n,
            j * n,
            self._place,
            counts,
        )
        return bool(hit < 0)

    def plan(
        self, grid: Grid, start: Floats, goal: Floats, planner: str, seed: int, budget: Budget | None
    ) -> ChainPlan:
        """See :func:`lampyris.chains.plan_chain`."""
        asked: dict[str, Any] = {
            "planner": planner,
            "grid": grid,
            "chain": self._chain,
            "start": start,
            "goal": goal,
            "seed": seed,
        }
        for q, status in ((start, Status.START_OCCUPIED), (goal, Status.GOAL_OCCUPIED)):
            if self.collides(q):
                return ChainPlan(status, **asked, checks=1)
        most = SAMPLES if budget is None or budget.expansions is None else budget.expansions
        seconds, stop = (None, None) if budget is None else (budget.seconds, budget.stop)
        trees = _Trees(self._chain, start, goal)
        status, rows = Status.LIMIT, None
        with cancellation.watching(seconds, stop) as own:
            try:
                if self._grown(trees, planner, np.random.Generator(np.random.PCG64(seed)), most):
                    status, rows = Status.FOUND, trees.path()
                    rows = self._shortened(rows, trees.state)
            except Cancelled:
                if own is None or (own.outer is not None and own.outer.is_over):
                    raise
                if own.was_cancelled:
                    status, rows = Status.CANCELLED, None
                elif rows is None:
                    status = Status.LIMIT
        checks, nodes, samples, *_ = trees.state.tolist()
        every = tuple(range(self._chain.joints))
        released = tuple(trees.order[: trees.state[5]].tolist()) if planner == "rrt-adaptive" else every
        return ChainPlan(
            status, **asked, configurations=rows, released=released, samples=samples, checks=checks, nodes=nodes,
        )  # fmt: skip

    def _grown(self, trees: _Trees, planner: str, rng: np.random.Generator, most: int) -> bool:
        """Whether the trees met within so many samples."""
        set_, n = self._settings, self._chain.joints
        low, high = np.array(self._chain.joint_limits).T.copy()
        stride = set_.stride * float(self._lever[0])
        left = most
        while left > 0:
            cancellation.checkpoint()
            draws = rng.random(min(left, _BATCH) * (n + 2))
            left -= _BATCH
            if grow(
                *self._world, self._lever, low, high, set_.piece, stride, draws,
                int(planner != "rrt"), int(planner == "rrt-adaptive"), set_.patience, set_.bias,
                trees.free, trees.order, trees.q, trees.side, trees.parent, self._place, trees.hits, trees.state,
            ):  # fmt: skip
                return True
            if trees.full:
                return False
        return False

    def _shortened(self, rows: Floats, state: NDArray[np.int64]) -> Floats:
        """The path without configurations that a free motion passes by: from each to the farthest it reaches."""
        kept, at = [0], 0
        while at < len(rows) - 1:
            far = len(rows) - 1
            while far > at + 1 and not self.is_free(rows, at, far, state[:1]):
                far -= 1
            kept.append(far)
            at = far
        return rows[kept]


class _Trees:
    """The arrays of a search."""

    def __init__(self, chain: Chain, start: Floats, goal: Floats) -> None:
        n = chain.joints
        self.joints = n
        self.q = np.zeros((_NODES + 2) * n)
        self.q[:n], self.q[n : 2 * n] = start, goal
        self.side = np.zeros(_NODES + 2, dtype=np.int8)
        self.side[1] = 1
        self.parent = np.zeros(_NODES + 2, dtype=np.int32)
        self.parent[1] = 1
        self.free = np.zeros(n, dtype=np.uint8)
        self.order, self.hits = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
        self.state = np.zeros(8, dtype=np.int64)
        self.state[1] = 2

    @property
    def full(self) -> bool:
        return int(self.state[1]) + 1 >= _NODES

    def path(self) -> Floats:
        """Configurations from start to goal, none twice in a row."""
        ahead, back = self._up(int(self.state[6])), self._up(int(self.state[7]))
        rows = self.q.reshape(-1, self.joints)[[*ahead[::-1], *back]]
        new = np.concatenate(([True], np.any(rows[1:] != rows[:-1], axis=1)))
        return rows[new]

    def _up(self, node: int) -> list[int]:
        """A node and those before it, as far as the root of its tree."""
        found = [node]
        while int(self.parent[found[-1]]) != found[-1]:
            found.append(int(self.parent[found[-1]]))
        return found
