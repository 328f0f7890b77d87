"""Bounds against brute force: what they forbid does not exist."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from lampyris.model.grid import Grid
from lampyris.model.moves import moves_named
from lampyris.model.scene import Scene
from lampyris.planning.field.solve import solve_field
from lampyris.reproduce.tables import bounds

STEPS = [(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if (dx, dy) != (0, 0)]


def costs_of_walks(steps: int) -> dict[tuple[int, int], set[int]]:
    """Costs in tenths of every walk of so many steps or fewer, by where it ends."""
    out: dict[tuple[int, int], set[int]] = {(0, 0): {0}}
    now = {((0, 0), 0)}
    for _ in range(steps):
        now = {((x + dx, y + dy), c + (14 if dx and dy else 10)) for (x, y), c in now for dx, dy in STEPS}
        for at, c in now:
            out.setdefault(at, set()).add(c)
    return out


def test_mixes_are_exactly_the_costs_of_walks() -> None:
    walks = costs_of_walks(7)
    for (dx, dy), cost in itertools.product(itertools.product(range(4), range(4)), range(71)):
        made = cost in walks.get((dx, dy), set())
        assert bool(bounds.mixes((0, 0), (dx, dy), cost)) == made, (dx, dy, cost)


def test_octile_is_the_cost_on_an_empty_map() -> None:
    scene = Scene(Grid(np.zeros((9, 12), dtype=np.bool_)), (0, 0), (3, 5), moves_named("dissertation"))
    exact = solve_field(scene).exact
    for x, y in itertools.product(range(12), range(9)):
        assert bounds.octile((x, y), (3, 5)) == exact[y, x]
        assert not bounds.why_not((x, y), (3, 5), int(exact[y, x]))


@pytest.mark.parametrize(
    ("goal", "cost", "word"), [((7, 9), 134, "straights"), ((7, 9), 116, "below"), ((7, 9), 124, "")]
)
def test_why_not(goal: tuple[int, int], cost: int, word: str) -> None:
    said = bounds.why_not((0, 0), goal, cost)
    assert (word in said) if word else not said


def test_sums_of_real_walks_are_within_their_range() -> None:
    """Walk down random fields one and two cells at a time: the sum of cost-to-go stays in the range."""
    rng = np.random.default_rng(6)
    seen = 0
    for _ in range(60):
        blocked = rng.random((15, 15)) < 0.3
        blocked[0, 0] = blocked[14, 14] = False
        field = solve_field(Scene(Grid(blocked), (0, 0), (14, 14), moves_named("dissertation")))
        if field.exact[0, 0] < 0:
            continue
        way, at = [0], 0
        while at != 14 * 15 + 14:
            at = int(field.parent.flat[at])
            way.append(at)
        for reach in (1, 2):
            stops = [*way[::reach]] + ([] if (len(way) - 1) % reach == 0 else [way[-1]])
            total = sum(int(field.exact.flat[c]) for c in stops)
            least, most = bounds.sum_range((0, 0), (14, 14), len(stops) - 1, reach)
            assert least <= total <= most
            assert len(stops) - 1 >= bounds.fewest((0, 0), (14, 14), reach)
            seen += 1
    assert seen > 20


def test_tenths() -> None:
    assert [bounds.tenths(t) for t in ("12.4", "46", "0.5098", "4544.5")] == [124, 460, None, 45445]
