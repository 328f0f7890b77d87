"""AD-GSO over attributes: what is minded, what it may cost, and that it gives in."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris import api
from lampyris.errors import SettingError
from lampyris.io.maps.library import load
from lampyris.io.maps.load import load_map
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.field.attributes import blend, density, kept_away
from lampyris.testing import check_planner
from sizes import sized

RNG = np.random.default_rng(0)  # never drawn from


def slow_density(blocked: np.ndarray, window: int) -> np.ndarray:
    height, width = blocked.shape
    out = np.zeros(blocked.shape)
    for y in range(height):
        for x in range(width):
            part = blocked[max(y - window, 0) : y + window + 1, max(x - window, 0) : x + window + 1]
            out[y, x] = part.mean()
    return out


def least_exit(cost: np.ndarray, kept: np.ndarray, end: tuple[int, int]) -> tuple[float, float]:
    """Cost and length of the best path from an end to a kept cell, by relaxing until nothing changes.

    Infinite cost: the robot cannot stand there. No diagonal step passes a cell of infinite cost.
    """
    height, width = cost.shape
    best = {end: (0.0, 0.0)}
    changed = True
    while changed:
        changed = False
        for (x, y), (missing, length) in list(best.items()):
            if kept[y, x]:
                continue
            for a, b in ((x + dx, y + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)):
                if not (0 <= a < width and 0 <= b < height) or (a, b) == (x, y):
                    continue
                if not np.isfinite((cost[b, a], cost[y, a], cost[b, x])).all():
                    continue
                through = (missing + cost[b, a], length + (3 if a != x and b != y else 2))
                if through < best.get((a, b), (np.inf, np.inf)):
                    best[a, b] = through
                    changed = True
    return min((v for (x, y), v in best.items() if kept[y, x]), default=(np.inf, np.inf))


@pytest.mark.nightly
@pytest.mark.parametrize("radius", [0.0, 0.5, 0.6, 1.2])
def test_the_exit_of_an_end_inside_the_margin_against_its_definition(radius: float) -> None:
    rng = np.random.default_rng(int(10 * radius))
    exits = none = 0
    for _ in range(60):
        blocked = rng.random((17, 19)) < rng.choice([0.01, 0.03, 0.08])
        grid, margin = Grid(blocked), int(rng.integers(1, 4))
        walls = np.argwhere(blocked)
        rows, columns = np.mgrid[:17, :19]
        gap = np.full(blocked.shape, margin + 1)
        for b, a in walls:
            gap = np.minimum(gap, np.maximum(abs(rows - b), abs(columns - a)))
        stands = slow_free(blocked, radius)
        kept = slow_free(gap <= margin, radius)
        assert np.array_equal(kept_away(grid, radius, margin, ()), kept)
        places = np.argwhere(stands & ~kept)
        if not len(places):
            continue
        y, x = (int(v) for v in places[rng.integers(len(places))])
        opened = kept_away(grid, radius, margin, ((x, y),))
        extra = opened & ~kept
        assert (opened >= kept).all()
        assert (extra <= stands).all()
        assert extra[y, x]
        steps = np.maximum(abs(rows - y), abs(columns - x))
        cost = np.where(stands & (steps <= margin + int(np.ceil(radius)) + 1), margin + 1.0 - gap, np.inf)
        cost = np.where(np.isfinite(cost), np.maximum(cost, 1.0), np.inf)
        best, length = least_exit(cost, kept, (x, y))
        if not np.isfinite(best):
            none += 1
            assert extra.sum() == 1
            continue
        exits += 1
        rising = stands & ~kept & (gap >= gap[y, x] + steps)
        assert (rising <= extra).all()
        # What is open besides is one path of the least cost, with the cells beside its diagonal steps.
        assert least_exit(np.where(opened, cost, np.inf), kept, (x, y)) == (best, length)
        assert (extra & ~rising).sum() <= 3 * (length // 2)
    assert exits > 15
    assert none > 0 or radius > 0.6


def slow_free(blocked: np.ndarray, radius: float) -> np.ndarray:
    """Where a disc can stand, wall by wall."""
    rows, columns = np.mgrid[: blocked.shape[0], : blocked.shape[1]]
    free = ~blocked
    for b, a in np.argwhere(blocked):
        dx, dy = np.maximum(abs(columns - a) - 0.5, 0.0), np.maximum(abs(rows - b) - 0.5, 0.0)
        free &= (dx * dx + dy * dy >= radius * radius) | (radius <= 0.5) & ~((columns == a) & (rows == b))
    return free


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.6, 1.2])
@pytest.mark.parametrize("start", [(2, 2), (2, 20)])
def test_a_wide_robot_beside_a_wall_keeps_the_margin_elsewhere(radius: float, start: tuple[int, int]) -> None:
    """The exit was inflated by the robot's radius, and closed: the margin was given up."""
    blocked = np.zeros((40, 40), dtype=bool)
    blocked[[0, -1]] = blocked[:, [0, -1]] = True
    scene = Scene(Grid(blocked), start, (30, 30), robot=Robot(radius=radius))
    plan = api.plan(scene, min_clearance=3, choice="exact")
    assert plan.attributes["min_clearance"] == 3
    assert plan.notes == ()


def test_the_margin_is_kept_around_the_ends_too_where_there_is_no_way_out() -> None:
    """env-3 has no cell 10 cells from walls: a box around each end was open, and nothing said so."""
    ground = load("env-3")
    query = ground.queries[0]
    plan = api.plan(
        Scene(ground.grid, query.start, query.goal), choice="exact", min_clearance=10, max_extra=None
    )
    assert plan.attributes["min_clearance"] < 10
    assert plan.notes[0].startswith("min_clearance 10 was weakened to ")


def test_a_place_beside_one_wall_is_left_straight_away_from_it() -> None:
    free = np.ones((12, 21), dtype=bool)
    free[0] = False
    opened = kept_away(Grid(~free), 0.0, 4, ((10, 1),)) & ~kept_away(Grid(~free), 0.0, 4, ())
    cone = {(x, y) for y in range(1, 5) for x in range(21) if abs(x - 10) <= y - 1}
    assert {(int(x), int(y)) for y, x in np.argwhere(opened)} == cone


def test_a_narrow_place_is_left_by_the_path_on_which_the_least_is_missing() -> None:
    free = np.ones((9, 15), dtype=bool)
    free[:, 0] = free[3, :4] = free[5, :4] = False  # a bay of one cell's width
    opened = kept_away(Grid(~free), 0.0, 2, ((3, 4),)) & ~kept_away(Grid(~free), 0.0, 2, ())
    assert opened[4, 3:6].all()
    deep = kept_away(Grid(~free), 0.0, 2, ((1, 4),)) & ~kept_away(Grid(~free), 0.0, 2, ())
    assert np.argwhere(deep).tolist() == [[4, 1]]  # no way out: the margin must be given up


def test_density_and_margin_against_their_definitions() -> None:
    rng = np.random.default_rng(1)
    for _ in range(40):
        blocked = rng.random(tuple(rng.integers(1, 12, 2))) < rng.choice([0.1, 0.3, 0.8])
        window = int(rng.integers(1, 5))
        assert np.array_equal(density(blocked, window), slow_density(blocked, window))
        kept = kept_away(Grid(blocked), 0.0, window, ())
        assert np.array_equal(kept, slow_density(blocked, window) == 0)


def test_attributes_add_up_and_stay_in_range() -> None:
    grid = Grid(np.eye(6, dtype=bool), terrain=np.full((6, 6), 200, dtype=np.uint8))
    heat = np.ones((6, 6))
    made = blend(grid, obstacle_density_weight=1.0, window=1, heat=heat, traffic_density_weight=4.0)
    assert made is not None
    assert made[0, 5] == 252
    assert not made[grid.blocked].any()
    assert blend(Grid(np.zeros((3, 3), dtype=bool)), obstacle_density_weight=2.0, window=1) is None


def least_clearance(plan, grid: Grid) -> int:
    """Chebyshev distance of the way from walls, its ends and their neighbourhood left out."""
    cells = plan.path.cells[2:-2]
    walls = np.argwhere(grid.blocked)[:, ::-1]
    return int(np.abs(cells[:, None, :] - walls[None, :, :]).max(axis=2).min())


def test_it_keeps_away_where_there_is_a_way_and_gives_in_where_there_is_none() -> None:
    open_ground = np.zeros((15, 25), dtype=bool)
    open_ground[4:11, 12] = True
    scene = Scene(Grid(open_ground), (2, 7), (22, 7))
    assert least_clearance(api.plan(scene), scene.grid) == 1
    assert least_clearance(api.plan(scene, min_clearance=2, max_extra=None), scene.grid) == 3
    narrow = open_ground.copy()
    narrow[:, 12] = True
    narrow[7, 12] = False
    assert api.plan(Scene(Grid(narrow), (2, 7), (22, 7)), min_clearance=3)


@pytest.mark.nightly
def test_the_way_is_no_longer_than_the_bound_allows() -> None:
    rng = np.random.default_rng(3)
    longer = 0
    for _ in range(30):
        blocked = rng.random((25, 25)) < 0.2
        blocked[0, 0] = blocked[24, 24] = False
        scene = Scene(Grid(blocked), (0, 0), (24, 24))
        plain = api.plan(scene, choice="exact")
        if not plain:
            continue
        for bound in (0.0, 0.05, 0.3):
            plan = api.plan(
                scene, choice="exact", obstacle_density_weight=4.0, min_clearance=1, max_extra=bound
            )
            assert plan.gap is not None
            assert plan.gap <= bound + 1e-12
            longer += plan.gap > 0
    assert longer > 5


def test_crowded_places_are_left_to_others() -> None:
    scene = Scene(load_map("env-1").grid, *_ends("env-1"))
    plain, minded = (
        api.plan(scene, choice="exact"),
        api.plan(scene, choice="exact", obstacle_density_weight=4.0, window=2),
    )
    share = density(scene.grid.blocked, 2)

    def met(plan) -> float:
        return float(share[plan.path.cells[:, 1], plan.path.cells[:, 0]].mean())

    assert met(minded) < met(plain)


def _ends(name: str):
    query = load_map(name).queries[0]
    return query.start, query.goal


def test_warm_cells_are_avoided_once_they_are_warm() -> None:
    scene = Scene(Grid(np.zeros((9, 21), dtype=bool)), (0, 4), (20, 4))
    session = AdGso(choice="exact", traffic_density_weight=4.0, max_extra=None).open(scene, RNG)
    belt = frozenset((10, y) for y in range(2, 7))
    for _ in range(30):
        plan = session.plan(Change(robot=(0, 4), obstacles=belt))
    after = session.plan(Change(robot=(0, 4)))
    assert plan
    assert after
    assert not belt & {tuple(c) for c in after.path.cells.tolist()}
    for _ in range(200):
        after = session.plan(Change(robot=(0, 4)))
    assert after.path.exact == 20 * scene.moves.straight  # it has cooled down


def test_simulations_with_every_attribute_are_clean() -> None:
    scene = Scene(load_map("env-2").grid, *_ends("env-2"), traffic=(RandomWalk(15),))
    trace = api.simulate(
        scene, seed=2, obstacle_density_weight=1.0, traffic_density_weight=1.0, min_clearance=1
    )  # refereed
    assert trace.arrived
    again = api.simulate(
        scene, seed=2, obstacle_density_weight=1.0, traffic_density_weight=1.0, min_clearance=1
    )
    assert np.array_equal(trace.robot, again.robot)


@pytest.mark.nightly
@sized("cases", 1, 3)
def test_the_contract_holds_with_attributes(cases: int) -> None:
    check_planner(
        AdGso(obstacle_density_weight=1.0, min_clearance=1, traffic_density_weight=0.5), cases=cases
    )


def test_blocked_ends_are_told_as_ever() -> None:
    blocked = np.zeros((5, 5), dtype=bool)
    blocked[0, 0] = True
    assert api.plan(Scene(Grid(blocked), (0, 0), (4, 4)), min_clearance=1).status is Status.START_OCCUPIED
    assert api.plan(Scene(Grid(blocked), (4, 4), (0, 0)), min_clearance=1).status is Status.GOAL_OCCUPIED


@pytest.mark.parametrize(
    ("setting", "value"),
    [("obstacle_density_weight", 5), ("obstacle_density_weight", -1.0), ("traffic_density_weight", True),
     ("window", 0), ("min_clearance", -1), ("min_clearance", 1.5), ("max_extra", -0.1), ("max_extra", float("nan"))],
)  # fmt: skip
def test_settings_out_of_range_are_refused(setting, value) -> None:
    with pytest.raises(SettingError) as refused:
        AdGso(**{setting: value})
    assert refused.value.code == setting.upper()


def test_what_is_weakened_is_said_with_the_reason() -> None:
    narrow = np.zeros((15, 25), dtype=bool)
    narrow[:, 12] = True
    narrow[7, 12] = False
    scene = Scene(Grid(narrow), (2, 7), (22, 7))
    plan = api.plan(scene, min_clearance=3)
    assert plan.notes == ("min_clearance 3 was weakened to 0 cells: no path to the goal keeps more",)
    assert plan.attributes == {
        "min_clearance": 0,
        "obstacle_density_weight": 0.0,
        "traffic_density_weight": 0.0,
        "window": 3,
    }
    longer = "the best path under it would be longer than max_extra allows"
    narrow[:, 12] = False
    narrow[3:, 12] = True
    scene = Scene(Grid(narrow), (2, 14), (22, 14))
    plan = api.plan(scene, min_clearance=2, max_extra=0.0)
    assert plan.notes == (
        f"min_clearance 2 was weakened to {plan.attributes['min_clearance']} cells: {longer}",
    )
    assert api.plan(scene, min_clearance=1, max_extra=None).notes == ()
    plan = api.plan(
        Scene(load_map("env-1").grid, *_ends("env-1")), obstacle_density_weight=4.0, max_extra=0.0
    )
    assert plan.attributes["obstacle_density_weight"] < 4.0
    assert plan.notes == (
        f"obstacle_density_weight 4 was weakened to {plan.attributes['obstacle_density_weight']:g}: {longer}",
    )
    assert api.plan(scene).notes == ()
    assert api.plan(scene).attributes == {}


def test_attributes_that_add_up_to_more_than_a_cell_can_cost_are_said() -> None:
    terrain = np.full((9, 9), 252, dtype=np.uint8)
    scene = Scene(Grid(np.eye(9, dtype=bool)[::-1] & (np.arange(9) > 3), terrain=terrain), (0, 0), (8, 8))
    plan = api.plan(scene, obstacle_density_weight=1.0, window=1, max_extra=None)
    assert len(plan.notes) == 1
    assert plan.notes[0].endswith("cells cost 5 times plain ground, the most there is, in place of more")


@pytest.mark.parametrize(("radius", "closed"), [(0.0, True), (0.4, False), (0.8, False)])
def test_gates_under_a_margin_are_those_of_the_cells_left_for_the_robots_centre(
    radius: float, closed: bool
) -> None:
    """An opening of five cells: with a margin of two, one is left. The map as given has no gate."""
    blocked = np.zeros((15, 21), dtype=np.bool_)
    blocked[:, 10] = True
    blocked[4:9, 10] = False
    scene = Scene(Grid(blocked), (2, 6), (18, 6), robot=Robot(radius=radius))
    margin = 2 if radius < 0.5 else 1
    for policy in ("close", "replan"):
        found = api.plan(scene, "ad-gso", min_clearance=margin, gates=policy)
        assert (found.status is Status.NO_PATH) == closed
        assert bool(found.gates_met) == (closed and policy == "replan")
        assert found.attributes["min_clearance"] == margin
        assert found.gates_in_map == ()
