"""What benchmarks compare while they time: who answers wrongly is found. Nothing is timed here."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lampyris.model.moves import MOVES

ROOT = Path(__file__).parents[1]
pytestmark = [
    pytest.mark.source,
    pytest.mark.skipif(not (ROOT / "benchmarks").is_dir(), reason="benchmarks are not shipped"),
]


@pytest.fixture(autouse=True)
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT))


def test_a_repairer_that_does_nothing_is_found() -> None:
    """Its field is right again once the cells are free again; in between it is not."""
    from benchmarks.bench_repair import Bench

    bench, rng = Bench(20, MOVES["octile"]), np.random.default_rng(1)
    cells = bench.pick(5, "near", rng)
    assert set(bench.round(cells)) == {"repair", "solve", "to robot", "D* Lite", "A*"}
    repair = bench.repairer.repair
    bench.repairer = SimpleNamespace(repair=lambda **_: repair())  # type: ignore[assignment]
    with pytest.raises(AssertionError):
        bench.round(cells)


def test_a_session_that_is_deaf_is_found() -> None:
    from benchmarks.bench_repair import Bench

    bench = Bench(20, MOVES["octile"])
    x, y = bench.robot
    around = [(x + dx, y + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]
    cells = [(u, v) for u, v in around if bench.free[v, u]]
    plan = bench.sessions["D* Lite"].plan()
    deaf: Any = SimpleNamespace(plan=lambda change: plan)
    bench.sessions["D* Lite"] = deaf
    with pytest.raises(AssertionError):
        bench.round(cells)


def test_a_way_that_is_longer_or_ends_elsewhere_is_found() -> None:
    from benchmarks.query_tables import compare_ways

    short, long = [(0, 0), (1, 1), (2, 1)], [(0, 0), (1, 0), (2, 0), (2, 1)]
    ends = [((0, 0), (2, 1))]
    compare_ways([short], [np.array(short)], ends)
    for ours, theirs, where in ((long, short, ends), (short, short, [((0, 0), (2, 2))])):
        with pytest.raises(AssertionError):
            compare_ways([ours], [theirs], where)


def test_the_textbook_goes_straight_where_nothing_is_in_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of equal sums the later tick first: one state a tick on an open map."""
    from benchmarks import bench_timed

    taken: list[Any] = []
    pop = bench_timed.heapq.heappop
    monkeypatch.setattr(bench_timed.heapq, "heappop", lambda heap: (taken.append(1), pop(heap))[1])
    side = 12
    left = [[max(side - 1 - x, side - 1 - y) for x in range(side)] for y in range(side)]
    free = [[True] * side for _ in range(side)]
    when, expanded = bench_timed.textbook(free, left, (0, 6), (side - 1, side - 1), set(), set(), 50)
    assert (when, expanded, len(taken)) == (11, 11, 12)
    # Somebody stands in the way for good, at the last step: it waits for nobody, it goes around.
    held = {(side - 2, side - 2, t) for t in range(60)}
    assert bench_timed.textbook(free, left, (0, 6), (side - 1, side - 1), held, set(), 50)[0] == 11


def test_only_a_limit_is_a_refusal() -> None:
    from benchmarks.bench_memory import refused

    assert refused("plan:astar", 5, "error[LIMIT]: 268435456 cells\n")[0].holds
    assert refused("plan:astar", 5, "error[MEMORY]: planning needs 25,607 MiB; allowed: 2,048 MiB\n")[0].holds
    for code, said in ((1, "Traceback ...\nerror[LIMIT]: x"), (5, "error[MEMORY]: x"), (0, ""), (-9, "")):
        verdict, _ = refused("plan:astar", code, said)
        assert not verdict.holds
        assert f"exit code {code}" in verdict.text


def test_of_a_large_field_the_whole_process_counts() -> None:
    """One verdict, and what falls short is named."""
    from benchmarks.bench_memory import _verdicts
    from benchmarks.figures import Figure, Spread

    def figure(task: str, value: float, *beside: Any) -> Any:
        return Figure(task, "MB", Spread.of([value]), *beside)

    rival = figure("field 512, octile", 10.0, "scipy", Spread.of([40.0]))
    sizes = {"four-connected": 399.0, "octile": 467.0}
    figures = [figure(f"field 4096, {kind}, whole process", mb) for kind, mb in sizes.items()]
    figures += [figure(f"field 4096, {kind}, its own", 300.0) for kind in sizes]
    first, *rest = _verdicts([*figures, rival])
    assert not first.holds
    assert first.text.endswith("short of it: octile")
    assert not any("4096" in one.text for one in rest)


@pytest.mark.nightly
def test_the_public_call_is_among_the_contestants_of_the_simulations() -> None:
    """The kernel alone was called "whole simulations"; and since its signature changed nothing ran at all."""
    from benchmarks import bench_study

    import lampyris
    from lampyris.io.maps import library

    ground = library.load("env-1")
    scene = lampyris.Scene(
        ground.grid,
        ground.queries[0].start,
        ground.queries[0].goal,
        moves="dissertation",
        traffic=(lampyris.RandomWalk(count=bench_study.WALKERS),),
    )
    query = bench_study.Query(scene)
    assert not query.differs(0)
    times = bench_study.measure([query], 1, 1)
    assert set(times) == {"runs", "public call", "plain Python"}
    assert all(len(found) == 1 and found[0] > 0 for found in times.values())
    query.public = query.run = lambda seed: lampyris.simulate(scene, "astar", seed=seed)  # type: ignore[method-assign]
    assert query.differs(0)


def test_the_page_on_performance_says_which_simulations_it_counts() -> None:
    sections = json.loads((ROOT / "docs" / "benchmarks.json").read_text(encoding="utf-8"))["sections"]
    (study,) = (section for section in sections if section["name"] == "study")
    known = {figure["task"]: figure for figure in study["figures"]}
    lines = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8").splitlines()
    (same,) = (line for line in lines if line.startswith("| the same walkers, AD-GSO"))
    three = [known[f"{who}, one core"] for who in ("runs", "public call", "study")]
    rates = [f"{figure['ours']['middle']:,.0f}" for figure in three]
    ratios = [f"{figure['ratio']:.3g}" for figure in three]
    assert f"{rates[0]}, {rates[1]} and {rates[2]} a second" in same
    assert f"{ratios[0]}, {ratios[1]} and {ratios[2]} times" in same
    assert f"two processes {known['runs, two processes']['ratio']:.3g} times one" in same
    (whole,) = (line for line in lines if line.startswith("| whole simulations"))
    assert "by the public call, `lampyris.simulate`" in whole
    assert rates[0] not in whole
