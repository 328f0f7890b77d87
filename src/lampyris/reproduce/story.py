"""Story: what the runs and measurements say in words. Every number and every comparison is computed."""

from __future__ import annotations

from collections.abc import Iterable

from lampyris.reproduce import claims
from lampyris.reproduce.measured import Costs
from lampyris.reproduce.results import USUAL, Difference, Method, Results
from lampyris.reproduce.verdict import NOT_REPRODUCIBLE


def chance(p: float) -> str:
    """A corrected p."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def change(d: Difference, unit: str) -> str:
    """A difference in words: more, less, or none that can be told."""
    if not d.sure:
        return f"no difference in {unit} that can be told ({chance(d.holm)})"
    word = "more" if d.mean.value > 0 else "fewer" if unit in COUNTED else "less"
    return f"{abs(d.share):.1f} % {word} {unit} ({chance(d.holm)})"


COUNTED = ("iterations", "expansions", "ticks")


def find(some: Iterable[Difference], what: str, a: str, b: str) -> Difference:
    """One of the differences."""
    return next(d for d in some if (d.what, d.a, d.b) == (what, a, b))


def method(some: Iterable[Method], name: str) -> Method:
    """One of the methods."""
    return next(m for m in some if m.name == name)


def best_nt(found: Results) -> claims.Said:
    """Is nt = 10 best? Against every other value, cost and iterations apart."""
    fewer = [d.a for d in found.nt_differences if d.what == "iterations" and d.sure and d.mean.value < 0]
    cheaper = [d.a for d in found.nt_differences if d.what == "cost" and d.sure and d.mean.value < 0]
    dearer = {d.a for d in found.nt_differences if d.what == "cost" and d.sure and d.mean.value > 0}
    both = [a for a in fewer if a not in dearer]
    n = method(found.nt, USUAL).means["cost"].n
    ours = f"beaten by {_listed(both)}" if both else "not surely beaten"
    parts = [f"on {n} queries of our maps, against nt = 10 (signed-rank tests, Holm)"]
    parts.append(f"fewer iterations with {_listed(fewer)}" if fewer else "none has fewer iterations")
    parts.append(f"a lower cost with {_listed(cheaper)}" if cheaper else "none has a lower cost")
    if both:
        parts.append(f"so {_listed(both)} decide less often, with no difference in cost that can be told")
    return claims.Said(ours, NOT_REPRODUCIBLE, "; ".join(parts))


def _listed(names: Iterable[str]) -> str:
    return "nt " + ", ".join(n.removeprefix("nt ") for n in names)


def storage(costs: Costs) -> claims.Said:
    """Does it need less storage? What sessions keep, measured."""
    kept = {k.planner: k.kept for k in costs.kept}
    mine, plain = kept["ad-gso"], kept["dijkstra"]
    why = (
        f"a session of AD-GSO keeps {mine / 1000:.1f} kB on a map of {costs.cells} cells, Dijkstra's "
        f"{plain / 1000:.1f}, A*'s {kept['astar'] / 1000:.1f}; the window of an iteration has "
        f"{costs.window / 1000:.1f} kB at most, but the whole field stays beside it: costs "
        f"{costs.costs_alone / 1000:.1f} kB and luciferin {costs.luciferin / 1000:.1f} kB more"
    )
    ratio = mine / plain
    ours = f"{ratio:.2f} times Dijkstra's"
    return claims.Said(ours, NOT_REPRODUCIBLE, f"no storage was measured there; here {why}")


MIXED, IMPROVED = ("ad-gso", "mixed"), ("ad-gso, gates closed", "improved")
"""What is compared in words: gates found on the way for both, and gates closed beforehand for both."""


def conclusion(found: Results, costs: Costs) -> str:
    """What AD-GSO really gains and what it does not, in one paragraph."""
    parts = (
        _gains(found, costs),
        _numbers(found),
        _shortest(found, costs),
        _memory(costs),
        _moving(found),
        _published(),
    )
    return " ".join(parts)


def _numbers(found: Results) -> str:
    some, measures = found.static_differences, ("iterations", "cost", "expansions")
    return (
        f"In numbers, over {some[0].test.n} queries, with gates found on the way for both, AD-GSO has "
        f"against the mixed method {_both(some, MIXED, measures)}; with gates closed for both, "
        f"against the improved method {_both(some, IMPROVED, measures)}."
    )


def _shortest(found: Results, costs: Costs) -> str:
    gap = method(found.static, "ad-gso, gates ignored").means["gap"]
    few = _percent(found, "astar", "ad-gso, gates ignored", "expansions")
    share = f"{100 * gap.value:.1f} % [{100 * gap.low:.1f}, {100 * gap.high:.1f}] (n {gap.n})"
    return (
        f"Where gates are left alone its ways are longer than the shortest by {share}, because the lowest "
        f"luciferin is not the least cost; plain A* finds the shortest with {few} of its expansions, and "
        f"took {1000 * costs.astar_s:.3f} ms where AD-GSO took {1000 * costs.plan_s:.3f}, of which its field "
        f"{1000 * costs.field_s:.3f} and each jump {1000 * costs.jump_s:.4f} (medians, this machine)."
    )


def _memory(costs: Costs) -> str:
    kept = {k.planner: k.kept for k in costs.kept}
    return (
        f"A session of it keeps {kept['ad-gso'] / 1000:.1f} kB where Dijkstra's keeps "
        f"{kept['dijkstra'] / 1000:.1f}: the window is small, but the field stays and luciferin is added."
    )


def _moving(found: Results) -> str:
    some, measures = found.moving_differences, ("ticks", "expansions")
    return (
        f"Among moving obstacles it has against the mixed method {_both(some, MIXED, measures)}, and against "
        f"the improved one {_both(some, IMPROVED, measures)}; it arrived in {_share(found, 'ad-gso')} of its "
        f"runs, the mixed method in {_share(found, 'mixed')}, the improved one in "
        f"{_share(found, 'improved')}. (The two baselines are ours, from what the dissertation tells of "
        "them, and all three look over their whole way at each call.)"
    )


def _published() -> str:
    return (
        "None of the published percentages can be taken over: those in path cost compare a length with a "
        "sum of cost-to-go, those in iterations and time were computed as (a - b) / (a + b) where "
        "(a - b) / a was meant, and the 300 % of velocity are a ratio to a constant of the author's."
    )


def _gains(found: Results, costs: Costs) -> str:
    """One sentence: which measures are surely better against both baselines, and which are not."""
    better: list[str] = []
    not_better: list[str] = []
    for what in ("iterations", "cost", "expansions"):
        both = [find(found.static_differences, what, *pair) for pair in (MIXED, IMPROVED)]
        good = all(d.sure and d.mean.value < 0 for d in both)
        (better if good else not_better).append("path length" if what == "cost" else what)
    kept = {k.planner: k.kept for k in costs.kept}
    (better if kept["ad-gso"] < kept["dijkstra"] else not_better).append("memory against Dijkstra")
    (better if costs.plan_s < costs.astar_s else not_better).append("time of a plan against A*")
    gains = ", ".join(better) or "nothing"
    return (
        f"On our six maps, where nothing moves, AD-GSO surely gains in: {gains}; it does not in: "
        f"{', '.join(not_better) or 'nothing'}."
    )


def _both(some: Iterable[Difference], pair: tuple[str, str], measures: Iterable[str]) -> str:
    known = tuple(some)
    names = {"cost": "length"}
    return ", ".join(change(find(known, m, *pair), names.get(m, m)) for m in measures)


def _percent(found: Results, a: str, b: str, measure: str) -> str:
    share = method(found.static, a).means[measure].value / method(found.static, b).means[measure].value
    return f"{100 * share:.0f} %"


def _share(found: Results, name: str) -> str:
    return f"{100 * method(found.moving, name).solved.value:.0f} %"
