"""How much of a test runs with every commit, and how much every night (``make check-nightly``)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest
from _pytest.mark.structures import ParameterSet


def sized(name: str, few: Any, many: Any) -> pytest.MarkDecorator:
    """The same test with few cases for every commit and with many every night; ``name`` is the argument."""
    nightly = pytest.param(many, id=f"{name} {many}", marks=pytest.mark.nightly)
    return pytest.mark.parametrize(name, [pytest.param(few, id=f"{name} {few}"), nightly])


def some(every: Iterable[Any], commit: int = 1) -> list[ParameterSet]:
    """Values for ``parametrize``: the first ones for every commit, the others, which are like them, for the
    night. A tuple holds one value for each argument.
    """
    rows = [row if isinstance(row, tuple) else (row,) for row in every]
    return [pytest.param(*row, marks=[] if k < commit else pytest.mark.nightly) for k, row in enumerate(rows)]
