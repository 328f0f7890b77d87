"""Distances to walls by arrays and by the kernel, and exact costs without the rest of a field."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.kernels.field.clearance import wall_distance
from lampyris.kernels.field.wall_distances import wall_distances
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.solve import exact_costs, solve
from lampyris.planning.swarm.search_space import SearchSpace
from lampyris.typing import BoolGrid

NEVER = 1 << 60


def by_the_kernel(blocked: BoolGrid, edge: bool) -> list[int]:
    height, width = blocked.shape
    squared, scratch = np.empty(blocked.size, dtype=np.int64), np.zeros((3, width), dtype=np.int64)
    walls = np.ascontiguousarray(blocked).view(np.uint8).ravel()
    wall_distance.run_plain(walls, squared, *scratch, height, width, NEVER, int(edge))
    return squared.tolist()


@pytest.mark.parametrize("edge", [True, False])
def test_arrays_give_what_the_kernel_gives(edge: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    maps = [
        rng.random(rng.integers(1, 24, 2)) < share
        for share in (0.0, 0.01, 0.1, 0.3, 0.9, 1.0) for _ in range(15)
    ]  # fmt: skip
    maps.append(maps[40][:, ::-1])
    wanted = [by_the_kernel(blocked, edge) for blocked in maps]
    monkeypatch.setattr(wall_distance, "_compiled", None)
    asked: list[int] = []
    monkeypatch.setattr(wall_distance, "_in_machine_code", lambda args: wall_distance.run_plain(*args))
    whole = wall_distance.run_plain
    monkeypatch.setattr(wall_distance, "run_plain", lambda *args: asked.append(1) or whole(*args))
    for blocked, squared in zip(maps, wanted, strict=True):
        assert wall_distances(blocked, NEVER, edge=edge).ravel().tolist() == squared
    assert 15 <= len(asked) <= len(maps) // 2  # without a wall, or with walls far away


@pytest.mark.parametrize("name", MOVES)
@pytest.mark.parametrize("priced", [False, True])
def test_exact_costs_and_parents_are_those_of_the_field(name: str, priced: bool) -> None:
    rng = np.random.default_rng(len(name))
    for share in (0.0, 0.1, 0.3):
        blocked = rng.random((13, 11)) < share
        terrain = (
            np.where(blocked, 0, rng.integers(0, 253, blocked.shape)).astype(np.uint8) if priced else None
        )
        blocked[0, 0] = blocked[12, 10] = False
        scene = Scene(Grid(blocked, terrain=terrain), (0, 0), (10, 12), name)
        free, moves = free_space(scene), moves_for(scene)
        for stop in (None, (0, 0), (5, 5)):
            field = solve(free, moves, scene.goal, terrain=terrain, stop=stop)
            exact, settled = exact_costs(free, moves, scene.goal, terrain=terrain, stop=stop)
            assert exact.tolist() == field.exact.tolist()
            assert exact.dtype == field.exact.dtype
            assert settled == field.expansions
        field, ground = (
            solve(free, moves, scene.goal, terrain=terrain),
            SearchSpace(scene, moves, free, frozenset()),
        )
        for y, x in np.argwhere(field.exact > 0).tolist():
            assert ground.parent(int(ground.flat(np.array((x, y))))) == field.step[y, x]
