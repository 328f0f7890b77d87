"""Exact costs: the octile integers order pairs as sqrt 2 does."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.model.moves import MOVES, PELL_P, PELL_Q, moves_named, octile_pair


def _less_by_squares(n1: int, m1: int, n2: int, m2: int) -> bool:
    """n1 + m1 sqrt 2 < n2 + m2 sqrt 2, by squaring: no float anywhere."""
    dn, dm = n1 - n2, m2 - m1  # dn < dm sqrt 2 ?
    if dn < 0 and dm >= 0:
        return True
    if dn >= 0 and dm <= 0:
        return False
    if dn >= 0:
        return dn * dn < 2 * dm * dm
    return dn * dn > 2 * dm * dm


def test_the_pell_pair_is_a_convergent() -> None:
    assert PELL_P**2 - 2 * PELL_Q**2 in (-1, 1)
    assert PELL_Q > 2**24
    assert abs(Fraction(PELL_P, PELL_Q) - Fraction(math.sqrt(2))) < Fraction(1, 2 * PELL_Q**2) + Fraction(
        1, 2**50
    )


def test_octile_integers_order_pairs_as_sqrt_2_does() -> None:
    rng = np.random.default_rng(1)
    octile = MOVES["octile"]
    for bits in (3, 8, 16, 23):
        for _ in range(5000):
            n1, m1, n2, m2 = (int(v) for v in rng.integers(0, 2**bits, 4))
            a, b = octile.exact((n1, m1)), octile.exact((n2, m2))
            assert (a < b) == _less_by_squares(n1, m1, n2, m2)
            assert (a == b) == ((n1, m1) == (n2, m2))


def test_octile_integers_order_the_closest_pairs_there_are() -> None:
    # Pell neighbours: n - m sqrt 2 is as near to 0 as integers of that size allow.
    octile = MOVES["octile"]
    n, m = 1, 1
    while m < 2**24:
        assert (octile.exact((n, 0)) < octile.exact((0, m))) == _less_by_squares(n, 0, 0, m)
        assert octile.exact((n, 0)) != octile.exact((0, m))
        n, m = n + 2 * m, n + m


@pytest.mark.parametrize("pair", [(0, 0), (1, 0), (0, 1), (12, 34), (2**23, 2**23), (0, 2**24), (2**24, 0)])
def test_octile_integers_give_their_pair_back(pair: tuple[int, int]) -> None:
    exact = MOVES["octile"].exact(pair)
    assert octile_pair(exact) == pair
    assert exact < 2**63
    assert MOVES["octile"].value(exact) == pair[0] + pair[1] * math.sqrt(2)
    assert MOVES["octile"].values(np.array([[exact, -1]])).tolist() == [
        [pair[0] + pair[1] * math.sqrt(2), math.inf]
    ]


def test_dissertation_costs_are_tenths() -> None:
    moves = MOVES["dissertation"]
    assert moves.value(moves.exact((4, 6))) == 12.4
    assert moves.values(np.array([124, -1], dtype=np.int32)).tolist() == [12.4, math.inf]


def test_parent_preference_is_diagonals_first_in_the_order_of_table_4_2() -> None:
    want = ((-1, -1), (1, -1), (-1, 1), (1, 1), (-1, 0), (1, 0), (0, -1), (0, 1))
    assert MOVES["dissertation"].offsets == MOVES["octile"].offsets == want
    assert MOVES["sixteen-connected"].reach == 2
    assert MOVES["sixteen-connected"].knight == 22
    assert len(MOVES["sixteen-connected"].offsets) == 16
    assert MOVES["four-connected"].diagonal == 0


def test_unknown_moves_are_refused() -> None:
    with pytest.raises(SettingError, match=r"octil.*dissertation"):
        moves_named("octil")
