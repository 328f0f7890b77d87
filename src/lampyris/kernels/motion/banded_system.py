"""Systems of equations whose unknowns meet only their two neighbours on either side."""

from __future__ import annotations

from lampyris.kernels._jit import kernel


@kernel(out=("first", "second", "diagonal", "right"))
def solve_banded(diagonal, first, second, right):
    """Solve a symmetric positive definite system of five diagonals by L D L^T; 1 if it is one, else 0.

    Parameters
    ----------
    diagonal : out, float64 (n,); destroyed.
    first, second : out, float64 (n,): the entries one and two to the left of the diagonal, row by row; the
        first one, and the first two, are not looked at. Destroyed.
    right : out, float64 (n,). Given: the right side. After: the solution, if the answer is 1.

    The answer is 0 where a pivot is not above 0: the matrix is not positive definite, or rounding has made it
    look so.
    """
    n = len(diagonal)
    for i in range(n):
        pivot = diagonal[i]
        value = right[i]
        near = first[i]
        if i > 1:
            far = second[i] / diagonal[i - 2]
            pivot -= far * second[i]
            value -= far * right[i - 2]
            near -= second[i] * first[i - 1]
            second[i] = far
        if i > 0:
            share = near / diagonal[i - 1]
            pivot -= share * near
            value -= share * right[i - 1]
            first[i] = share
        if not pivot > 0.0:
            return 0
        diagonal[i] = pivot
        right[i] = value
    for i in range(n - 1, -1, -1):
        value = right[i] / diagonal[i]
        if i + 1 < n:
            value -= first[i + 1] * right[i + 1]
        if i + 2 < n:
            value -= second[i + 2] * right[i + 2]
        right[i] = value
    return 1
