"""The searches over ridges, each compared with another way to the same answer."""

from __future__ import annotations

import heapq

import numpy as np
import pytest
from scipy import ndimage

from lampyris.kernels.map_models.ridge_walk import FAR, cheapest, connected, widest

SIDES = ((1, 0), (0, 1), (-1, 0), (0, -1))
ALL = (*SIDES, (1, 1), (-1, 1), (-1, -1), (1, -1))
COSTS = (10, 10, 10, 10, 14, 14, 14, 14)


class Ground:
    """Random values from 1 to 6 on the free cells of a map of 12 x 15 with a border, and all steps between them."""

    def __init__(self, seed: int, around: tuple[tuple[int, int], ...]) -> None:
        rng = np.random.default_rng(seed)
        inside = np.where(rng.random((10, 13)) < 0.7, rng.integers(1, 7, (10, 13)), 0)
        inside[0, 0] = inside[-1, -1] = 6
        self.value = np.pad(inside, 1).astype(np.int64)
        self.stride = self.value.shape[1]
        self.flat = self.value.ravel()
        self.jump = np.array([dy * self.stride + dx for dx, dy in around], dtype=np.int64)
        self.start, self.goal = self.stride + 1, self.flat.size - self.stride - 2
        self.steps = np.zeros(self.flat.size, dtype=np.uint8)
        for at in np.flatnonzero(self.flat):
            for k, add in enumerate(self.jump):
                self.steps[at] |= int(self.flat[at + add] > 0) << k

    def heap(self) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(self.flat.size + 1, dtype=np.int32), np.zeros(self.flat.size, dtype=np.int32)


@pytest.mark.parametrize("around", [SIDES, ALL], ids=["sides", "corners too"])
@pytest.mark.parametrize("seed", range(6))
def test_regions_are_those_of_scipy(seed: int, around: tuple[tuple[int, int], ...]) -> None:
    ground = Ground(seed, around)
    for least in (1, 3, 6):
        mark, queue = np.zeros(ground.flat.size, dtype=np.uint8), np.empty(ground.flat.size, dtype=np.int32)
        many = connected(ground.flat, least, ground.jump, ground.start, mark, queue)
        labels, _ = ndimage.label(ground.value >= least, np.ones((3, 3)) if around is ALL else None)
        want = (labels == labels.ravel()[ground.start]).ravel()
        assert np.array_equal(mark != 0, want)
        assert many == want.sum()


@pytest.mark.parametrize("around", [SIDES, ALL], ids=["sides", "corners too"])
@pytest.mark.parametrize("seed", range(6))
def test_no_path_is_wider(seed: int, around: tuple[tuple[int, int], ...]) -> None:
    """By trying every value: the ends are in one region of cells of at least that value, and of no greater one."""
    ground = Ground(seed, around)
    worst = np.full(ground.flat.size, FAR, dtype=np.int64)
    found = widest(ground.steps, ground.jump, ground.flat, ground.start, ground.goal, worst, *ground.heap())
    want = -1
    for least in range(1, 7):
        labels, _ = ndimage.label(ground.value >= least, np.ones((3, 3)) if around is ALL else None)
        a, b = labels.ravel()[[ground.start, ground.goal]]
        want = least if a == b != 0 else want
    assert found == want


@pytest.mark.parametrize("seed", range(6))
def test_the_cheapest_path_is_decided_by_rank(seed: int) -> None:
    """By the textbook's search, whose heap holds costs and ranks in pairs."""
    ground = Ground(seed, ALL)
    n = ground.flat.size
    rank = np.random.default_rng(seed).permutation(n).astype(np.int64)
    paid, before = np.full(n, FAR, dtype=np.int64), np.zeros(n, dtype=np.int32)
    cost = np.array(COSTS, dtype=np.int64)
    cheapest(ground.steps, ground.jump, cost, rank, ground.start, ground.goal, paid, before, *ground.heap())
    best, came = {ground.start: 0}, {}
    heap, done = [(0, int(rank[ground.start]), ground.start)], set()
    while heap:
        so_far, _, at = heapq.heappop(heap)
        if at in done:
            continue
        done.add(at)
        if at == ground.goal:
            break
        for k, add in enumerate(ground.jump.tolist()):
            to = at + add
            if ground.steps[at] >> k & 1 and so_far + COSTS[k] < best.get(to, FAR):
                best[to], came[to] = so_far + COSTS[k], at
                heapq.heappush(heap, (best[to], int(rank[to]), to))
    assert paid[ground.goal] == best.get(ground.goal, FAR)
    assert {to: int(before[to]) for to in came} == came
