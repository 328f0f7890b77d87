"""Every planner that calls itself optimal, asked at random: exact integer costs, all four step sets."""

from __future__ import annotations

import pytest
from query_checks import NAMES, ask_at_random

from lampyris.planners import registry


def exact() -> list:
    rows = registry.table()
    return [registry.make(name) for name in registry.names() if rows[name].traits.optimal]


def test_the_exact_ones_are_all_here() -> None:
    assert {p.name for p in exact()} >= {
        "astar", "dijkstra", "jps", "bidirectional-astar", "fastest",
        "dstar", "focussed-dstar", "lpa-star", "dstar-lite",
    }  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_random_queries(name: str) -> None:
    assert ask_at_random(exact(), name, 5, 60)["found"] > 10


@pytest.mark.nightly
@pytest.mark.parametrize("name", NAMES)
def test_twenty_thousand_random_queries_in_all(name: str) -> None:
    words = ask_at_random(exact(), name, 42, 5_000)
    print(f"\n{name}, {len(exact())} planners: {dict(words)}")
    assert words.total() == 5_000
