"""Array aliases that say element type and axes. Units are said where the array is held.

Grids are always ``(height, width)``, row 0 on top; lists of cells are ``(n, 2)`` with ``x`` (column) first.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

BoolGrid: TypeAlias = NDArray[np.bool_]
"""bool, (height, width)."""
IntGrid: TypeAlias = NDArray[np.int64] | NDArray[np.int32]
"""signed integers, (height, width)."""
StepGrid: TypeAlias = NDArray[np.int8]
"""int8, (height, width): index of a step in :attr:`lampyris.model.moves.Moves.offsets`, -1 where none."""
ByteGrid: TypeAlias = NDArray[np.uint8]
"""uint8, (height, width)."""
FloatGrid: TypeAlias = NDArray[np.float64]
"""float64, (height, width)."""
Cells: TypeAlias = NDArray[np.int32]
"""int32, (n, 2): x (column), y (row)."""
Ticks: TypeAlias = NDArray[np.int64]
"""int64, (n,): ticks of the simulation."""
Floats: TypeAlias = NDArray[np.float64]
"""float64, (n,)."""
Points: TypeAlias = NDArray[np.float64]
"""float64, (n, 2): x and y, cells unless said otherwise; the centre of cell (x, y) is at (x, y)."""
Cell: TypeAlias = tuple[int, int]
"""One cell: x (column), y (row), origin top left."""
CellLike: TypeAlias = Sequence[int] | NDArray[Any]
"""What constructors take for a cell: two whole numbers."""
CellsLike: TypeAlias = Sequence[CellLike] | NDArray[Any]
"""What constructors take for several."""
