"""Waypoints, lines, terms: what a particle means and what it is worth, counted again by plain loops."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from lampyris.kernels._jit import Kernel
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import count_steps, path_of
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.swarm import walks
from lampyris.planning.swarm.encoding import anywhere, evenly, on_lines, waypoints_of
from lampyris.planning.swarm.fitness_terms import TERMS, Weights, score
from lampyris.planning.swarm.potential_field import repulsion
from lampyris.planning.swarm.search_space import SearchSpace
from lampyris.planning.swarm.walks import LineWalks, trace, walk_of
from lampyris_selfcheck.reference.paths.search import cost_of, distances
from planning.swarm_scenes import NAMES, random_scene, scene_of


def ground_of(scene: Scene) -> SearchSpace:
    return SearchSpace(scene, moves_for(scene), free_space(scene), frozenset())


def open_ground(name: str, side: int = 17) -> SearchSpace:
    return ground_of(Scene(Grid(np.zeros((side, side), dtype=bool)), (0, 0), (side - 1, side - 1), name))


@pytest.mark.parametrize("name", NAMES)
def test_lines_lead_from_node_to_node_at_the_least_cost_of_the_open_plane(name: str) -> None:
    ground = open_ground(name)
    known = distances([[True] * 17 for _ in range(17)], name, (8, 8))
    ends = [(x, y) for x in range(17) for y in range(17) if (x, y) != (8, 8)]
    nodes = np.array([[(8, 8), end] for end in ends])
    lines = trace(ground, nodes)
    assert len(lines) == len(ends)
    for k, end in enumerate(ends):
        cells = walk_of(ground, lines[k])
        assert tuple(cells[0]) == (8, 8)
        assert tuple(cells[-1]) == end
        for a, b in pairwise(cells.tolist()):
            assert (b[0] - a[0], b[1] - a[1]) in MOVES[name].offsets
        if max(abs(end[0] - 8), abs(end[1] - 8)) < 7:  # nearer the edge the reference has no room for knights
            assert cost_of(count_steps(cells, MOVES[name]), name) == cost_of(known[end], name)
        # As straight as can be: within a cell of the segment.
        dx, dy = end[0] - 8, end[1] - 8
        off = np.abs((cells[:, 0] - 8) * dy - (cells[:, 1] - 8) * dx) / np.hypot(dx, dy)
        assert off.max() <= 1.0


def test_several_legs_and_legs_of_no_length() -> None:
    ground = open_ground("octile")
    nodes = np.array([[(0, 0), (3, 1), (3, 1), (5, 5)], [(2, 2), (2, 2), (2, 2), (1, 2)]])
    ways = trace(ground, nodes)
    assert ways.first.tolist() == [0, 3 + 4, 7 + 1]
    assert walk_of(ground, ways[1]).tolist() == [[2, 2], [1, 2]]
    assert (3, 1) in set(map(tuple, walk_of(ground, ways[0]).tolist()))


@pytest.mark.commit(1)
@pytest.mark.parametrize("part", [1, 2, 7, 40])
def test_in_pieces_walks_are_what_they_are_at_once(part: int, monkeypatch: pytest.MonkeyPatch) -> None:
    cut = 0
    for seed in range(25):
        scene = random_scene(seed)
        ground = ground_of(scene)
        rng = np.random.default_rng(seed)
        nodes = rng.integers(0, (scene.grid.width, scene.grid.height), size=(5, 4, 2))
        nodes[:, 2] = nodes[:, 1]  # a leg without a step
        nodes = nodes[(nodes != nodes[:, :1]).any(axis=(1, 2))]
        if not len(nodes):
            continue
        monkeypatch.undo()
        at_once = trace(ground, nodes)
        assert len(list(at_once.pieces())) == 1
        worth = score(ground, at_once, Weights())
        monkeypatch.setattr(walks, "PART", part)
        for batch in (LineWalks(ground, nodes), at_once):
            pieces = list(batch.pieces())
            cut += len(pieces) > 1
            assert batch.steps == at_once.steps == sum(piece.paths.steps for piece in pieces)
            made, seen = batch.whole(), 0
            for name in ("first", "at", "step", "legal", "missing"):
                assert getattr(made, name).tolist() == getattr(at_once, name).tolist()
            for piece in pieces:
                own = piece.paths.first + seen
                assert (own[1:-1] == at_once.first[piece.walks][1:]).all()
                assert at_once.first[piece.walk] <= own[0]
                assert own[-1] <= at_once.first[piece.walks.stop]
                goes_on = at_once.first[piece.walk] < own[0]
                assert piece.before == (at_once.step[own[0] - 1] if goes_on else -1)
                assert piece.paths.at.tolist() == at_once.at[own[0] : own[-1]].tolist()
                seen = int(own[-1])
            judged = score(ground, batch, Weights())
            for name in ("fitness", "exact", "legal"):
                assert getattr(judged, name).tolist() == getattr(worth, name).tolist()
            one = batch[len(batch) - 1].whole()
            assert one.at.tolist() == at_once[len(batch) - 1].at.tolist()
    assert cut > 20


def test_between_two_looks_a_bounded_number_of_steps_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """A swarm on long corridors walks a hundred million steps in a round; it was deaf for a second."""
    ground = open_ground("octile", 300)
    nodes = np.random.default_rng(1).integers(0, 300, size=(40, 60, 2))
    made: list[int] = []
    legal = SearchSpace.legal

    def counted(self: SearchSpace, at: np.ndarray, step: np.ndarray) -> np.ndarray:
        made.append(at.size)
        return legal(self, at, step)

    looks: list[int] = []
    monkeypatch.setattr(Kernel, "pays", lambda kernel, *args: False)
    monkeypatch.setattr(SearchSpace, "legal", counted)
    monkeypatch.setattr(walks, "checkpoint", lambda: looks.append(sum(made)))
    batch = LineWalks(ground, nodes)
    score(ground, batch, Weights())
    assert sum(made) == batch.steps > 200_000
    assert max(b - a for a, b in pairwise([*looks, sum(made)])) <= walks.PART + 300
    assert len(made) < 10


def plainly(scene: Scene, cells: np.ndarray) -> dict[str, int]:
    """Every term of one walk, step by step."""
    moves, free = moves_for(scene), free_space(scene)
    grid = scene.grid
    walls = np.argwhere(grid.blocked)[:, ::-1]
    ring = [(2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (-1, 2), (-2, 2), (-2, 1), (-2, 0), (-2, -1), (-2, -2)]
    ring += [(-1, -2), (0, -2), (1, -2), (2, -2), (2, -1)]
    out = dict.fromkeys(TERMS, 0)
    before = None
    for (x, y), (u, v) in pairwise(cells.tolist()):
        dx, dy = u - x, v - y
        price = moves.costs[moves.offsets.index((dx, dy))]
        out["length"] += price
        if grid.terrain is not None:
            out["terrain"] += price // 63 * int(grid.terrain[v, u])
        sx, sy = int(np.sign(dx)), int(np.sign(dy))
        beside = []
        if abs(dx) == abs(dy) == 1 and not moves.corner_cutting:
            beside = [(x + dx, y), (x, y + dy)]
        if abs(dx * dy) == 2:
            beside = [(x + sx, y + sy), (x + sx, y) if abs(dx) == 2 else (x, y + sy)]
        out["blocked"] += not all(free[b, a] for a, b in [*beside, (x, y), (u, v)])
        if len(walls):
            gap = np.maximum(np.abs(walls - (u, v)) - 0.5, 0.0)
            reach = 2.0 + scene.robot.radius
            nearest = float(np.sqrt((gap * gap).sum(axis=1)).min())
            out["clearance"] += round(1000 * (1 - min(nearest, reach) / reach))
        scale = 2 // max(abs(dx), abs(dy))
        now = ring.index((dx * scale, dy * scale))
        if before is not None:
            out["turns"] += min((now - before) % 16, (before - now) % 16)
        before = now
    return out


def test_every_term_is_what_a_plain_count_gives() -> None:
    counted = dict.fromkeys(TERMS, 0)
    for seed in range(60):
        scene = random_scene(seed)
        ground = ground_of(scene)
        rng = np.random.default_rng(seed)
        sides = (scene.grid.width, scene.grid.height)
        nodes = rng.integers(0, sides, size=(4, 5, 2))
        nodes = nodes[(nodes != nodes[:, :1]).any(axis=(1, 2))]
        if not len(nodes):
            continue
        ways = trace(ground, nodes)
        told = {name: term(ground, ways) for name, term in TERMS.items()}
        judged = score(ground, ways, Weights(1.0, 7.0, 0.5, 0.25))
        for k in range(len(ways)):
            plain = plainly(scene, walk_of(ground, ways[k]))
            assert plain == {name: int(value[k]) for name, value in told.items()}
            unit = ground.moves.unit
            worth = (plain["length"] + plain["terrain"]) / unit + 7.0 * plain["blocked"]
            worth += 0.5 * plain["clearance"] / 1000 + 0.25 * plain["turns"] / 2
            assert judged.fitness[k] == pytest.approx(worth, rel=1e-12)
            assert judged.legal[k] == (plain["blocked"] == 0)
            assert judged.exact[k] == plain["length"] + plain["terrain"]
            for name, value in plain.items():
                counted[name] += value
    assert all(counted.values()), counted


def test_the_seed_is_written_as_waypoints_of_exactly_its_cost() -> None:
    seen = 0
    for seed in range(120):
        scene = random_scene(seed)
        ground = ground_of(scene)
        exact = int(ground.exact[scene.start[1], scene.start[0]])
        if exact <= 0:
            continue
        seen += 1
        way = ground.shortest_path(scene.start)
        assert path_of(way, ground.moves, scene.grid.terrain).exact == exact
        start = np.array(scene.start)
        for k in (1, 4):
            base = waypoints_of(ground, way, k)
            assert len(base) >= k
            for encoding in (anywhere(ground, base), on_lines(ground, start, base)):
                ways = encoding.lines(ground, start, encoding.of(base))
                judged = score(ground, ways, Weights())
                assert judged.legal[0]
                assert judged.exact[0] == exact
    assert seen > 60


def test_few_waypoints_are_enough_on_an_open_map() -> None:
    ground = open_ground("octile")
    assert len(waypoints_of(ground, ground.shortest_path((0, 0)), 3)) <= 4


def test_particles_decode_to_cells_and_snap_to_the_nearest_that_reaches_the_goal() -> None:
    for seed in range(40):
        scene = random_scene(seed)
        ground = ground_of(scene)
        reach = np.argwhere(ground.exact >= 0)[:, ::-1]
        if not len(reach):
            continue
        for y in range(scene.grid.height):
            for x in range(scene.grid.width):
                near = ground.cells(ground.nearest[ground.flat(np.array([[x, y]]))])[0]
                rings = np.abs(reach - (x, y)).max(axis=1)
                assert (reach == near).all(axis=1).any()
                assert np.abs(near - (x, y)).max() == rings.min()


def test_encodings_chose_what_they_say() -> None:
    ground = ground_of(scene_of(["S......", ".......", "......G"]))
    base = evenly(np.array([0, 0]), np.array([6, 2]), 2)
    assert base.tolist() == [[2, 0], [4, 1]]
    free, lined = anywhere(ground, base), on_lines(ground, np.array([0, 0]), base)
    assert free.box.dimensions == 4
    assert lined.box.dimensions == 2
    corner = free.places(np.array([[0.0, 0.0, 1.0, 1.0]]))[0]
    assert corner.tolist() == [[0.0, 0.0], [7.0, 3.0]]
    cells = walk_of(ground, free.lines(ground, np.array([0, 0]), np.array([[0.0, 0.0, 1.0, 1.0]])).whole())
    assert cells[-1].tolist() == [6, 2]
    slid = lined.places(np.array([[0.0, 0.99]]))[0]
    assert slid[:, 0].tolist() == [2.5, 4.5]
    assert slid[:, 1].tolist() == [0.0, 0.99 * 3]


def test_walls_push_away_and_blocked_cells_push_out() -> None:
    ground = ground_of(scene_of(["S......", ".......", "...#...", ".......", "......G"]))
    force = repulsion(ground, 1.0, 3.0)
    assert force[2, 2, 0] < 0 < force[2, 4, 0]
    assert force[1, 3, 1] < 0 < force[3, 3, 1]
    assert np.abs(force).max() <= 1.0
    assert np.abs(force[2, 3]).max() == 1.0
