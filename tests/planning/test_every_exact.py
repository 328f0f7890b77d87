"""Every planner that calls itself optimal, one session for many starts: exact costs, all four step sets.

``lampyris selfcheck random`` asks far more, each question in a session of its own.
"""

from __future__ import annotations

import pytest
from query_checks import NAMES, ask_at_random

from lampyris.planning import registry


def exact() -> list:
    rows = registry.list_planners()
    return [registry.make(name) for name in registry.names() if rows[name].traits.optimal]


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", NAMES)
def test_random_queries(name: str) -> None:
    assert ask_at_random(exact(), name, 5, 60)["found"] > 10
