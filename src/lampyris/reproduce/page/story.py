"""Story: what the runs and measurements say in words. Every number and every comparison is computed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from lampyris.reproduce.runs.measured import Costs
from lampyris.reproduce.runs.results import USUAL, Difference, Method, Results
from lampyris.reproduce.tables import claims
from lampyris.reproduce.tables.verdict import NOT_REPRODUCIBLE


def chance(p: float) -> str:
    """A corrected p."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def change(d: Difference, unit: str) -> str:
    """A difference in words: more, less, or none that can be shown."""
    if not d.sure:
        return f"no difference in {unit} that can be shown ({chance(d.holm)})"
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
    costlier = {d.a for d in found.nt_differences if d.what == "cost" and d.sure and d.mean.value > 0}
    both = [a for a in fewer if a not in costlier]
    n = method(found.nt, USUAL).means["cost"].n
    ours = f"beaten by {_listed(both)}" if both else "not surely beaten"
    parts = [f"on {n} queries of our maps, against nt = 10 (signed-rank tests, Holm)"]
    parts.append(f"fewer iterations with {_listed(fewer)}" if fewer else "none has fewer iterations")
    parts.append(f"a lower cost with {_listed(cheaper)}" if cheaper else "none has a lower cost")
    if both:
        parts.append(f"so {_listed(both)} decide less often, with no difference in cost that can be shown")
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


@dataclass(frozen=True, slots=True)
class MethodPair:
    """Two methods that are compared in words.

    Parameters
    ----------
    a, b : their labels in the runs.
    name : what the pair is called, with its gates.
    more : which of the two does what, where the name does not say.
    """

    a: str
    b: str
    name: str
    more: str = ""


COMPARED = (
    MethodPair("ad-gso", "mixed", "mixed with gates found on the way by both"),
    MethodPair(
        "ad-gso", "improved", "improved as printed",
        "AD-GSO finds gates on the way, improved closes them beforehand; ",
    ),
    MethodPair("ad-gso, gates closed", "improved", "improved with gates closed for both"),
)  # fmt: skip
"""Every comparison is reported with its variant of AD-GSO: the two of the dissertation, where the
improved method alone closes gates beforehand, and the one that is like with like. None may be left out."""
STATIC = ("iterations", "cost", "expansions")
MOVING = ("ticks", "cost", "expansions")
NAMES = {"cost": "length"}


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
    return f"In numbers, AD-GSO has {_in_numbers(found.static_differences, STATIC)}."


def _in_numbers(some: Iterable[Difference], measures: Iterable[str]) -> str:
    """Every pair with its variant, its queries and each of its differences."""
    known, whats = tuple(some), tuple(measures)
    clauses = []
    for pair in COMPARED:
        each = [find(known, what, pair.a, pair.b) for what in whats]
        words = ", ".join(change(d, NAMES.get(d.what, d.what)) for d in each)
        clauses.append(f"against {pair.name} ({pair.more}{each[0].test.n} queries) {words}")
    return "; ".join(clauses)


def _shortest(found: Results, costs: Costs) -> str:
    gap = method(found.static, "ad-gso, gates ignored").means["gap"]
    few = _percent(found, "astar", "ad-gso, gates ignored", "expansions")
    share = f"{100 * gap.value:.1f} % [{100 * gap.low:.1f}, {100 * gap.high:.1f}] (n {gap.n})"
    return (
        f"With gates ignored its paths are longer than the shortest by {share}, because the lowest "
        f"luciferin is not the least cost; plain A* finds the shortest with {few} of its expansions, and "
        f"took {1000 * costs.astar_s:.3f} ms where AD-GSO took {1000 * costs.plan_s:.3f}, of which its field "
        f"{1000 * costs.field_s:.3f} and each jump {1000 * costs.jump_s:.4f} (medians, this machine)."
    )


def _memory(costs: Costs) -> str:
    kept = {k.planner: k.kept for k in costs.kept}
    return (
        f"Its session then keeps {kept['ad-gso'] / 1000:.1f} kB where Dijkstra's keeps "
        f"{kept['dijkstra'] / 1000:.1f}: the window is small, but the field stays and luciferin is added."
    )


def _moving(found: Results) -> str:
    variants = dict.fromkeys(name for pair in COMPARED for name in (pair.a, pair.b))
    arrived = ", ".join(f"{_CALLED[name]} in {_share(found, name)}" for name in variants)
    return (
        f"Among moving obstacles it {_surely(found.moving_differences, MOVING)}; in numbers, it has "
        f"{_in_numbers(found.moving_differences, MOVING)}. Of their runs there arrived: {arrived}. (The two "
        "baselines are ours, from what the dissertation tells of them, and all look over their whole path at "
        "each call.)"
    )


_CALLED = {
    "ad-gso": "AD-GSO that finds gates on the way",
    "ad-gso, gates closed": "AD-GSO with gates closed beforehand",
    "mixed": "mixed",
    "improved": "improved",
}


def _published() -> str:
    return (
        "None of the published percentages can be taken over: those in path cost compare a length with a "
        "sum of cost-to-go, those in iterations and time were computed as (a - b) / (a + b) where "
        "(a - b) / a was meant, and the 300 % of velocity are a ratio to a constant of the author's."
    )


def _gains(found: Results, costs: Costs) -> str:
    """What is surely better and what surely worse, each with the comparisons in which it is."""
    kept = {k.planner: k.kept for k in costs.kept}
    alone = {
        "memory against Dijkstra": kept["ad-gso"] < kept["dijkstra"],
        "time of a plan against A*": costs.plan_s < costs.astar_s,
    }
    better = ", ".join(what for what, good in alone.items() if good) or "nothing"
    worse = ", ".join(what for what, good in alone.items() if not good) or "nothing"
    return (
        f"On our six maps, where nothing moves, AD-GSO {_surely(found.static_differences, STATIC)}; with "
        f"gates ignored, as memory and time were measured, it gains in: {better}; it does not in: {worse}."
    )


def _surely(some: Iterable[Difference], measures: Iterable[str]) -> str:
    """Gains and losses that are significant, each with the pairs in which they are."""
    known = tuple(some)
    gains: list[str] = []
    losses: list[str] = []
    for what in measures:
        each = [(find(known, what, pair.a, pair.b), pair) for pair in COMPARED]
        name = NAMES.get(what, what)
        gains += _where(name, [pair for d, pair in each if d.sure and d.mean.value < 0])
        losses += _where(name, [pair for d, pair in each if d.sure and d.mean.value > 0])
    return (
        f"surely gains in: {', '.join(gains) or 'nothing'}; it surely loses in: "
        f"{', '.join(losses) or 'nothing'}"
    )


def _where(name: str, pairs: list[MethodPair]) -> list[str]:
    if not pairs:
        return []
    if len(pairs) == len(COMPARED):
        return [f"{name} (in all {len(COMPARED)} comparisons)"]
    return [f"{name} (only against {' and against '.join(pair.name for pair in pairs)})"]


def _percent(found: Results, a: str, b: str, measure: str) -> str:
    share = method(found.static, a).means[measure].value / method(found.static, b).means[measure].value
    return f"{100 * share:.0f} %"


def _share(found: Results, name: str) -> str:
    return f"{100 * method(found.moving, name).solved.value:.0f} %"
