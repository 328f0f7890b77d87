"""The main job through the front door: published queries, and samples of 3x3 grids and random grids.

``lampyris selfcheck grids`` and ``random`` ask the planners themselves by the million. ``make check-nightly``
runs all published queries here, greedy AD-GSO's too, and prints what it found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from heapq import heappop, heappush
from pathlib import Path

import numpy as np
import pytest

import lampyris

EIGHT = [(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if (dx, dy) != (0, 0)]


def reference(
    blocked: np.ndarray, start: tuple[int, int], goal: tuple[int, int]
) -> tuple[str, tuple[int, int] | None]:  # type: ignore[type-arg]
    """Verdict and (straights, diagonals) by a plain Dijkstra over pairs; 8 neighbours, no corner cutting."""
    h, w = blocked.shape
    if blocked[start[1], start[0]]:
        return "start-occupied", None
    if blocked[goal[1], goal[0]]:
        return "goal-occupied", None
    best = {start: (0, 0)}
    done: set[tuple[int, int]] = set()
    queue = [(0.0, 0, 0, start)]
    while queue:
        _, n, m, (x, y) = heappop(queue)
        if (x, y) in done:
            continue
        done.add((x, y))
        if (x, y) == goal:
            return "found", (n, m)
        for dx, dy in EIGHT:
            u, v = x + dx, y + dy
            if not (0 <= u < w and 0 <= v < h) or blocked[v, u] or blocked[y, u] or blocked[v, x]:
                continue
            pair = (n, m + 1) if dx and dy else (n + 1, m)
            value = pair[0] + pair[1] * math.sqrt(2)
            old = best.get((u, v))
            if old is None or value < old[0] + old[1] * math.sqrt(2):
                best[(u, v)] = pair
                heappush(queue, (value, *pair, (u, v)))
    return "no-path", None


def ask(blocked: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> None:  # type: ignore[type-arg]
    verdict, pair = reference(blocked, start, goal)
    scene = lampyris.Scene(lampyris.Grid(blocked), start, goal)
    for name, settings in (("astar", {}), ("dijkstra", {}), ("ad-gso", {"choice": "exact"})):
        plan = lampyris.plan(scene, planner=name, **settings)
        assert plan.status == verdict, (name, blocked.tolist(), start, goal)
        assert plan.steps == pair, (name, blocked.tolist(), start, goal)
    greedy = lampyris.plan(scene)
    assert greedy.status == verdict
    if pair is not None:
        assert greedy.gap is not None
        assert greedy.gap >= 0
        assert greedy.optimal_cost == pair[0] + pair[1] * math.sqrt(2)


def test_small_grids_sample() -> None:
    rng = np.random.default_rng(12)
    for code in rng.integers(0, 512, 40):
        blocked = np.array([(int(code) >> k) & 1 for k in range(9)], bool).reshape(3, 3)
        s, g = (int(v) for v in rng.integers(0, 9, 2))
        ask(blocked, (s % 3, s // 3), (g % 3, g // 3))


def random_grids(count: int) -> Iterator[tuple[np.ndarray, tuple[int, int], tuple[int, int]]]:  # type: ignore[type-arg]
    rng = np.random.default_rng(2022)
    for _ in range(count):
        h, w = (int(v) for v in rng.integers(5, 61, 2))
        blocked = rng.random((h, w)) < rng.uniform(0, 0.5)
        yield (
            blocked,
            (int(rng.integers(w)), int(rng.integers(h))),
            (int(rng.integers(w)), int(rng.integers(h))),
        )


def test_random_grids_sample() -> None:
    for blocked, start, goal in random_grids(40):
        ask(blocked, start, goal)


def queries(path: Path) -> list[tuple[tuple[int, int], tuple[int, int], float, float]]:
    """(start, goal, published length, tolerance) of each line of a .scen file, by a reader of its own."""
    out = []
    for line in path.read_text(encoding="ascii").splitlines():
        words = line.split()
        if len(words) != 9:
            continue
        digits = len(words[8].partition(".")[2])
        length = float(words[8])
        sx, sy, gx, gy = (int(v) for v in words[4:8])
        out.append(((sx, sy), (gx, gy), length, max(1e-5 * length, 0.5 * 10.0**-digits)))
    return out


def compare(movingai: Path, every: int) -> None:
    total = 0
    for scen in sorted(movingai.glob("*.scen")):
        grid = lampyris.load_grid(scen.with_suffix(""))
        gaps, wrong = [], 0
        for start, goal, length, tolerance in queries(scen)[::every]:
            scene = lampyris.Scene(grid, start, goal)
            for name, settings in (("astar", {}), ("dijkstra", {}), ("ad-gso", {"choice": "exact"})):
                wrong += (
                    not abs(lampyris.plan(scene, planner=name, record=False, **settings).cost - length)
                    <= tolerance
                )
            greedy = lampyris.plan(scene, record=False)
            assert greedy.status == "found", (scen.name, start, goal)
            assert greedy.gap is not None
            gaps.append(greedy.gap)
        total += len(gaps)
        q = np.quantile(gaps, (0.5, 0.9, 0.99))
        print(
            f"\n{scen.stem:20} queries={len(gaps):5d} x 3 exact planners, differences={wrong}; "
            f"greedy ad-gso found all; gap mean {np.mean(gaps):.3%}, median {q[0]:.3%}, "
            f"90% {q[1]:.3%}, 99% {q[2]:.3%}, max {max(gaps):.3%}",
            end="",
        )
        assert wrong == 0
    print(f"\nall: queries={total}")


@pytest.mark.nightly
def test_published_lengths_sample(movingai: Path) -> None:
    compare(movingai, 400)


@pytest.mark.nightly
def test_every_published_length(movingai: Path) -> None:
    compare(movingai, 1)
