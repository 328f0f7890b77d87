"""Neighbours, leaders, ranges and groups against their definitions, robot by robot."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from swarm_maps import walled

from lampyris.kernels.swarm.leaders import choose_leaders, in_sight
from sizes import some


def setting(seed: int, n: int = 24) -> dict[str, Any]:
    grid = walled(seed)
    rng = np.random.default_rng(seed)
    size = grid.resolution
    wide = grid.width * size
    side = float(rng.choice([0.7, 2.0, 50.0]))
    columns = math.ceil(wide / side)
    free = np.argwhere(~grid.blocked)[:, ::-1]
    places = (free[rng.integers(len(free), size=n)] + rng.random((n, 2))) * size
    return {
        "grid": grid, "x": places[:, 0].copy(), "y": places[:, 1].copy(), "luciferin": rng.integers(0, 9, n) * 1.0,
        "draw": rng.random(n), "sight": int(rng.integers(2)), "most": 6.0, "beta": 0.3, "wanted": 3,
        "side": side, "columns": columns, "rows": columns, "ranges": rng.random(n) * 6.0,
    }  # fmt: skip


def called(given: dict[str, Any], *, plain: bool) -> dict[str, Any]:
    grid, n = given["grid"], len(given["x"])
    out = {
        "ranges": given["ranges"].copy(), "leader": np.zeros(n, np.int64), "count": np.zeros(n, np.int64),
        "group": np.zeros(n, np.int64),
    }  # fmt: skip
    bins = given["columns"] * given["rows"]
    words = (
        given["x"], given["y"], given["luciferin"], given["draw"], grid.blocked.view(np.uint8).ravel(), grid.width, grid.height,
        grid.resolution, given["sight"], given["most"], given["beta"], given["wanted"], given["side"], given["columns"],
        given["rows"], *out.values(), np.zeros(bins + 1, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n),
    )  # fmt: skip
    (choose_leaders.run_plain if plain else choose_leaders)(*choose_leaders.complete(words))
    return out


def sees(grid: Any, a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether no blocked square is crossed by a line, in exact fractions."""
    size = Fraction(grid.resolution)
    (ax, ay), (bx, by) = ((Fraction(x) / size, Fraction(y) / size) for x, y in (a, b))
    low_x, low_y, high_x, high_y = min(ax, bx) - 1, min(ay, by) - 1, max(ax, bx), max(ay, by)
    for v, u in np.argwhere(grid.blocked).tolist():
        if not (low_x <= u <= high_x and low_y <= v <= high_y):
            continue
        low, high = Fraction(0), Fraction(1)
        for p, q, least in ((ax, bx, u), (ay, by, v)):
            if p == q:
                if not least < p < least + 1:
                    high = Fraction(-1)
                continue
            one, other = sorted(((least - p) / (q - p), (least + 1 - p) / (q - p)))
            low, high = max(low, one), min(high, other)
        if low < high:
            return False
    return True


@pytest.mark.parametrize("seed", some(range(40), 5))
def test_as_defined(seed: int) -> None:
    given = setting(seed)
    found = called(given, plain=seed % 2 == 0)
    x, y, glow, grid = given["x"], given["y"], given["luciferin"], given["grid"]
    n = len(x)
    links: list[set[int]] = [{i} for i in range(n)]
    for i in range(n):
        near = [
            j for j in range(n)
            if glow[j] > glow[i]
            and math.dist((x[i], y[i]), (x[j], y[j])) < given["ranges"][i]
            and (not given["sight"] or sees(grid, (x[i], y[i]), (x[j], y[j])))
        ]  # fmt: skip
        assert found["count"][i] == len(near)
        wanted = given["ranges"][i] + given["beta"] * (given["wanted"] - len(near))
        assert found["ranges"][i] == pytest.approx(min(given["most"], max(0.0, wanted)), abs=1e-12)
        assert (found["leader"][i] in near) if near else found["leader"][i] == -1
        for j in near:
            links[i].add(j)
            links[j].add(i)
    for i in range(n):
        reached, front = {i}, [i]
        while front:
            for j in links[front.pop()] - reached:
                reached.add(j)
                front.append(j)
        assert found["group"][i] == min(reached)


def test_plain_and_compiled_agree() -> None:
    from lampyris.kernels import _jit

    for seed in range(3):
        given = setting(seed)
        plain = called(given, plain=True)
        with _jit.compiled_only():
            compiled = called(given, plain=False)
        for name, value in plain.items():
            assert np.array_equal(value, compiled[name]), name


def test_the_roulette_draws_by_the_difference_of_luciferin() -> None:
    """One robot at 0 between neighbours that are brighter by 1, 2 and 5."""
    n = 4
    x, y = np.array([5.0, 5.5, 4.5, 5.0]), np.array([5.0, 5.0, 5.0, 5.5])
    glow = np.array([0.0, 1.0, 2.0, 5.0])
    counted = np.zeros(n)
    for draw in (np.arange(800) + 0.5) / 800:
        leader = np.zeros(n, np.int64)
        choose_leaders.run_plain(
            x, y, glow, np.full(n, draw), np.zeros(100, np.uint8), 10, 10, 1.0, 0, 9.0, 0.1, 5, 10.0, 1, 1, np.full(n, 2.0),
            leader, np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(2, np.int64), np.zeros(n, np.int64),
            np.zeros(n, np.int64), np.zeros(n),
        )  # fmt: skip
        counted[leader[0]] += 1
    assert counted.tolist() == [0, 100, 200, 500]


def test_a_wall_blocks_the_line_and_a_touched_corner_does_not() -> None:
    blocked = np.zeros(25, dtype=np.uint8)
    blocked[2 * 5 + 2] = 1
    for ends, seen in (
        ((0.5, 0.5, 4.5, 4.5), 0), ((2.5, 0.5, 2.5, 4.5), 0), ((0.5, 1.9, 4.5, 1.9), 1), ((4.5, 2.1, 0.5, 2.1), 0),
        ((1.0, 3.0, 3.0, 1.0), 1), ((0.5, 3.5, 1.5, 3.5), 1), ((1.0, 1.0, 1.0, 4.0), 1), ((0.25, 3.75, 2.25, 1.75), 1),
        ((1.5, 2.5, 2.5, 1.5), 1),
    ):  # fmt: skip
        assert in_sight.run_plain(*ends, blocked, 5, 5, 1.0) == seen, ends
