"""What planners are called where people read: one title for each, in its summary."""

from __future__ import annotations

from lampyris.planning import registry
from lampyris.planning.registry import LONGEST_TITLE


def test_every_planner_has_a_title_of_its_own_in_its_summary() -> None:
    rows = [row for kind in registry.GROUPS for row in registry.list_planners(kind).values()]
    titles = [row.title for row in rows]
    assert len(set(titles)) == len(titles) > 40
    for row in rows:
        assert row.summary.startswith(f"{row.title}: "), row.name
        assert len(row.title) <= LONGEST_TITLE
        assert registry.title_of(row.name) == row.title
    assert registry.title_of("astar") == "A*"
    assert registry.title_of("nobody") == "nobody"
