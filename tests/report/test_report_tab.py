"""Tab: values as tables show them."""

from __future__ import annotations

import math

import pytest

from lampyris.errors import InternalFault
from lampyris.report.html.table import Tab, shown


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (None, 2, "-"), (math.nan, 2, "-"), (math.inf, None, "inf"), (-math.inf, 3, "-inf"),
        ("a & b", None, "a & b"), (True, 2, "yes"), (False, None, "no"), (12345678, 2, "12345678"),
        (0.125, 2, "0.12"), (1 / 3, None, "0.333333"),
        (-0.0, None, "0"), (-0.004, 2, "0.00"), (-0.006, 2, "-0.01"), (2.0, None, "2"), (2.0, 3, "2.000"),
    ],
)  # fmt: skip
def test_a_value_has_one_text(value: str | float | None, digits: int | None, text: str) -> None:
    assert shown(value, digits) == text


def test_columns_of_words_stand_left_and_numbers_right() -> None:
    tab = Tab(
        "t",
        "T",
        ("who", "cost", "note"),
        (("astar", 1.5, None), ("gso", None, "late")),
        digits=(None, 1, None),
    )
    assert tab.align == "lrl"
    assert tab.texts() == (("astar", "1.5", "-"), ("gso", "-", "late"))
    assert Tab("t", "T", ("who",), ()).align == "l"
    assert Tab("t", "T", ("who",), ()).digits == (None,)


@pytest.mark.parametrize("more", [{"rows": ((1,),)}, {"align": "l"}, {"align": "lc"}, {"digits": (1,)}])
def test_a_crooked_table_is_a_fault_of_ours(more: dict[str, object]) -> None:
    with pytest.raises(InternalFault):
        Tab(**{"name": "t", "title": "T", "header": ("a", "b"), "rows": ((1, 2),)} | more)  # type: ignore[arg-type]
