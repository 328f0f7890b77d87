"""The steps of a fleet's robots: how neighbours of cells are laid out, and which steps cross.

``edge`` is one row a cell, each cell's neighbours first, then ``cells`` for those that are missing; ``degree`` says how many
there are. With four-connected moves a row has 4 numbers. With octile moves it has 16: 8 neighbours, and for each of them the
cell beside a diagonal step in the row of the map that the step leaves, or -1 for a straight step. Cells are numbered row by row
and both cells beside a diagonal step are free, so the other one follows from it.

``passing`` is 1 for each cell that has three neighbours or more with a degree of at least 2: who comes to it from one of them has
two cells to go on to that are no dead ends. It is 0 throughout with octile moves.

Two diagonal steps of one block of 2 x 2 cells in one tick cross in its centre.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel


@kernel()
def beside(edge, wide, here, there):
    """The cell beside a diagonal step, in the row that the step leaves; -1 for a straight step or a wait.

    ``wide`` : numbers of a row of ``edge``. The other cell beside the step is ``there - (beside - here)``.
    """
    if wide == 4 or there == here:
        return -1
    row = wide * here
    for k in range(8):
        if edge[row + k] == there:
            return int(edge[row + 8 + k])
    return -1


@kernel()
def crosses(edge, wide, occupant, following, here, there):
    """Whether a robot that has decided crosses the step from ``here`` to ``there``.

    ``occupant`` : the robot on each cell, or -1. ``following`` : the cell each robot goes to, or -1.
    """
    one = beside(edge, wide, here, there)
    if one < 0:
        return False
    other = there - (one - here)
    a = occupant[one]
    b = occupant[other]
    return (a >= 0 and following[a] == other) or (b >= 0 and following[b] == one)
