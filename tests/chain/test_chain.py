"""Chains of links: what is found is free by polygons, joints are released one by one, wrong questions are refused."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from shapely import STRtree
from shapely.geometry import Polygon, box

import lampyris
from lampyris.errors import SettingError, UsageError
from lampyris.model.chain.chain import MOST_LINKS, MOST_METRES, MOST_TURN, Chain
from lampyris.model.chain.chain_plan import ChainPlan
from lampyris.planning.chain.rrt import PLANNERS, ChainSearch, RrtSettings
from lampyris.referee.chain import check_chain_plan

GRID = lampyris.Grid(np.zeros((20, 20), dtype=bool), resolution=0.5)


def walled(*walls: tuple[int, int, int, int], yaw: float = 0.0) -> lampyris.Grid:
    blocked = np.zeros((20, 20), dtype=bool)
    for top, low, left, right in walls:
        blocked[top:low, left:right] = True
    return lampyris.Grid(blocked, resolution=0.5, origin=(1.0, -2.0, yaw))


def polygons(chain: Chain, q: np.ndarray) -> list[Polygon]:
    """The links in metres of the map frame."""
    made, (x, y), angle = [], chain.base, 0.0
    for length, width, turn in zip(chain.links, chain.widths, q.tolist(), strict=True):
        angle += turn
        c, s = math.cos(angle), math.sin(angle)
        h = width / 2
        far = (x + length * c, y + length * s)
        made.append(
            Polygon(
                [
                    (x + h * s, y - h * c),
                    (far[0] + h * s, far[1] - h * c),
                    (far[0] - h * s, far[1] + h * c),
                    (x - h * s, y + h * c),
                ]
            )
        )
        x, y = far
    return made


def cells_of(grid: lampyris.Grid) -> STRtree:
    """Blocked cells as squares of the map frame."""
    x0, y0, yaw = grid.origin
    c, s = math.cos(yaw), math.sin(yaw)
    squares = []
    for row, column in np.argwhere(grid.blocked).tolist():
        low, left = (grid.height - 1 - row) * grid.resolution, column * grid.resolution
        ring = box(left, low, left + grid.resolution, low + grid.resolution).exterior.coords
        squares.append(Polygon([(x0 + c * x - s * y, y0 + s * x + c * y) for x, y in ring]))
    return STRtree(squares)


def assert_free(plan: ChainPlan, every: float = 0.02) -> int:
    """Each configuration, ``every`` radians along each motion, by shapely; how many were looked at."""
    assert plan.configurations is not None
    rows, tree, looked = plan.configurations, cells_of(plan.grid), 0
    for a, b in pairwise(rows):
        for t in np.linspace(0, 1, 2 + int(np.abs(b - a).max() / every)):
            links = polygons(plan.chain, a + t * (b - a))
            looked += 1
            for k, link in enumerate(links):
                assert not any(tree.geometries[i].intersection(link).area > 0 for i in tree.query(link))
                assert not any(links[j].intersection(link).area > 0 for j in range(k - 1))
    return looked


POST = walled((9, 11, 15, 17))
ARM = Chain((6.0, 3.0), [0.8] * 4, 0.15, (-2.6, 2.6))


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("yaw", [0.0, 0.6])
def test_every_configuration_is_free_by_polygons(planner: str, yaw: float) -> None:
    grid = walled((8, 10, 15, 17), (15, 17, 12, 14), yaw=yaw)
    base = tuple(grid.to_metres([(10, 9)])[0].tolist())
    arm = replace(ARM, base=base)
    start, goal = [yaw - 0.9, 0.1, 0.1, 0.0], [yaw + 1.3, 0.0, -0.4, 0.3]
    found = lampyris.plan_chain(grid, arm, start, goal, planner, seed=3)
    assert found
    assert assert_free(found) > 20
    assert found.configurations is not None
    np.testing.assert_array_equal(found.configurations[0], start)
    np.testing.assert_array_equal(found.configurations[-1], goal)
    assert found == lampyris.plan_chain(grid, arm, start, goal, planner, seed=3)


def test_single_configurations_agree_with_polygons() -> None:
    """What the kernel calls free is free; what polygons call free by the spare that the kernel adds, it calls free."""
    rng = np.random.default_rng(5)
    blocked = rng.random((20, 20)) < 0.12
    blocked[8:12, 8:12] = False
    grid = lampyris.Grid(blocked, resolution=0.5)
    arm = Chain((5.0, 5.0), [0.7, 0.9, 0.6, 0.8], [0.2, 0.1, 0.15, 0.1], (-3.0, 3.0))
    search, tree = ChainSearch(grid, arm, RrtSettings()), cells_of(grid)
    frame, counts = box(0, 0, 10, 10), [0, 0]
    for _ in range(400):
        q = rng.uniform(-3.0, 3.0, 4)
        links = polygons(arm, q)
        meets = any(tree.geometries[i].intersection(a).area > 1e-9 for a in links for i in tree.query(a))
        meets |= any(links[j].intersection(links[k]).area > 1e-9 for k in range(4) for j in range(k - 1))
        meets |= any(not frame.contains(a) for a in links)
        assert search.collides(q) == meets
        counts[meets] += 1
    assert min(counts) > 40


def test_joints_are_released_one_by_one() -> None:
    free = lampyris.plan_chain(GRID, replace(ARM, base=(5.0, 5.0)), [0.0] * 4, [1.5, 0.3, 0.2, 0.0])
    assert (free.released, free.samples) == ((), 1)
    start, goal = [-0.7, 0, 0, 0], [0.7, 0, 0, 0]
    plans = [lampyris.plan_chain(POST, ARM, start, goal, seed=seed) for seed in range(3)]
    assert all(plans)
    assert all(1 <= len(plan.released) < 4 and assert_free(plan) for plan in plans)
    for plan in plans:
        # Joints that were not released stay on the line from start to goal, but where the chain is on its way to a node.
        assert plan.configurations is not None
        locked = [k for k in range(1, 4) if k not in plan.released]
        assert np.abs(plan.configurations[:, locked]).max() < 1e-9


@pytest.mark.nightly
def test_it_solves_as_often_as_plain_rrt() -> None:
    start, goal = [-0.8, 0, 0, 0], [0.8, 0, 0, 0]
    budget = lampyris.Budget(expansions=3_000)
    solved = {
        who: sum(
            bool(lampyris.plan_chain(POST, ARM, start, goal, who, seed=s, budget=budget)) for s in range(20)
        )
        for who in PLANNERS
    }
    assert solved["rrt-adaptive"] >= solved["rrt"]
    assert solved["rrt-adaptive"] == 20


def test_limits_occupied_ends_and_walls_all_round() -> None:
    blocked = lampyris.plan_chain(POST, ARM, [0.0, 0, 0, 0], [1.5, 0, 0, 0])
    assert (blocked.status, blocked.configurations) == ("start-occupied", None)
    assert lampyris.plan_chain(POST, ARM, [1.5, 0, 0, 0], [0.0, 0, 0, 0]).status == "goal-occupied"
    shut = walled((0, 20, 15, 16), (0, 20, 3, 4), (9, 10, 3, 16))
    few = lampyris.Budget(expansions=60)
    none = lampyris.plan_chain(
        shut, replace(ARM, base=(6.0, 2.0)), [-1.2, 0, 0, 0], [1.5, 0, 0, 0], budget=few
    )
    assert none.status in ("start-occupied", "goal-occupied", "limit")
    held = lampyris.plan_chain(
        GRID, Chain((5.0, 5.0), [2.0]), [0.0], [3.0], budget=lampyris.Budget(expansions=1)
    )
    assert held.status in ("found", "limit")
    assert held.samples <= 1


def test_the_referee_refuses_what_is_not_free() -> None:
    plan = lampyris.plan_chain(POST, ARM, [-0.7, 0, 0, 0], [0.7, 0, 0, 0])
    rows = plan.configurations
    assert rows is not None
    straight = replace(plan, configurations=rows[[0, -1]])
    ends, cut = (
        replace(plan, configurations=rows[1:]),
        replace(plan, chain=replace(ARM, joint_limits=(-0.5, 0.5))),
    )
    folded = replace(
        plan, goal=rows[0] + [0, 2.6, 2.6, 2.0], configurations=[rows[0], rows[0] + [0, 2.6, 2.6, 2.0]]
    )
    twice = replace(plan, released=(1, 1))
    rules = [check_chain_plan(one) for one in (plan, straight, ends, cut, folded, twice)]
    assert [None if one is None else one.rule for one in rules] == [
        None,
        "link",
        "ends",
        "limits",
        "link",
        "released",
    ]
    assert "wall" in str(rules[1])
    assert "links" in str(rules[4])
    off = replace(plan, chain=replace(ARM, base=(1.5, 3.0)), grid=walled())
    assert "leaves the map" in str(
        check_chain_plan(
            replace(off, goal=rows[0] + [2.6, 0, 0, 0], configurations=[rows[0], rows[0] + [2.6, 0, 0, 0]])
        )
    )


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"links": []}, "links"), ({"links": [1.0, -1.0]}, "links"), ({"links": "x"}, "links"),
        ({"widths": [0.1, 0.2]}, "widths"), ({"widths": 0.0}, "widths"), ({"base": (1.0,)}, "base"),
        ({"joint_limits": (1.0, -1.0)}, "joint_limits"), ({"joint_limits": (-180, 180)}, "joint_limits"),
    ],
)  # fmt: skip
def test_wrong_chains(change: dict[str, object], word: str) -> None:
    good: dict[str, object] = {"base": (0.0, 0.0), "links": [1.0] * 3}
    with pytest.raises(SettingError, match=word):
        Chain(**(good | change))  # type: ignore[arg-type]


def test_limits_of_chains_on_both_sides() -> None:
    for n in (MOST_LINKS - 1, MOST_LINKS, MOST_LINKS + 1):
        assert _refused({"links": [1.0] * n}) == (n > MOST_LINKS)
    for x in (MOST_METRES - 1, MOST_METRES, MOST_METRES + 1):
        assert _refused({"base": (x, 0.0)}) == (x > MOST_METRES)
    for angle in (MOST_TURN - 0.1, MOST_TURN, MOST_TURN + 0.1):
        assert _refused({"joint_limits": (-1.0, angle)}) == (angle > MOST_TURN)


def _refused(change: dict[str, object]) -> bool:
    good: dict[str, object] = {"base": (0.0, 0.0), "links": [1.0] * 3}
    try:
        Chain(**(good | change))  # type: ignore[arg-type]
    except SettingError:
        return True
    return False


def test_wrong_questions() -> None:
    with pytest.raises(SettingError, match="joint 2"):
        lampyris.plan_chain(GRID, ARM, [0, 0, 2.7, 0], [0, 0, 0, 0])
    with pytest.raises(SettingError, match="4 finite angles"):
        lampyris.plan_chain(GRID, ARM, [0, 0], [0, 0, 0, 0])
    with pytest.raises(UsageError, match="rrt-adaptive"):
        lampyris.plan_chain(GRID, ARM, [0] * 4, [1] * 4, "rrt-adaptiv")
    with pytest.raises(UsageError, match="patience"):
        lampyris.plan_chain(GRID, ARM, [0] * 4, [1] * 4, patient=3)
    with pytest.raises(SettingError, match="stride"):
        lampyris.plan_chain(GRID, ARM, [0] * 4, [1] * 4, stride=0.0)


def test_a_picture(tmp_path: Path) -> None:
    plan = lampyris.plan_chain(POST, ARM, [-0.7, 0, 0, 0], [0.7, 0, 0, 0])
    for k in (1, 2):
        lampyris.draw_chain(plan, tmp_path / f"{k}.svg")
    first, second = ((tmp_path / f"{k}.svg").read_bytes() for k in (1, 2))
    assert first == second
    failed = replace(plan, status=lampyris.Status.LIMIT, configurations=None)
    lampyris.draw_chain(failed, tmp_path / "3.svg")
    assert len((tmp_path / "3.svg").read_bytes()) < len(first)


@pytest.mark.source
def test_the_example_of_the_page_finds_a_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "map_models.md"
    (block,) = re.findall(
        r"^```python\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(block, page.name, "exec"), names)
    plan = names["plan"]
    assert isinstance(plan, lampyris.ChainPlan)
    assert plan.status is lampyris.Status.FOUND
    assert len(plan.released) > 0, "the post is in the way of the stretched arm"
