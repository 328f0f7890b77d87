"""Connected regions of an image, as ``scipy.ndimage.label`` numbers them; ``tests/site`` compares the two."""

from __future__ import annotations

from typing import Any

import numpy as np

_SIDES = ((0, 1, 0), (1, 1, 1), (0, 1, 0))


def label(input: Any, structure: Any = None, output: Any = None) -> tuple[Any, int]:
    """Regions of what is not zero, numbered from 1 in the order in which rows from the top meet them.

    Parameters
    ----------
    input : (height, width).
    structure : 3 x 3, symmetric: which neighbours belong together; None: those by sides.

    Returns
    -------
    int32 (height, width), and how many regions there are.
    """
    image = np.asarray(input) != 0
    if image.ndim != 2 or output is not None:
        raise NotImplementedError("two dimensions, into a new array")
    near = np.asarray(_SIDES if structure is None else structure) != 0
    height, width = image.shape
    steps = [(j - 1, i - 1) for j in range(3) for i in range(3) if near[j, i] and (j, i) != (1, 1)]
    # With a rim that is in no region, neighbours need no check of the border.
    wide = width + 2
    free = bytearray(wide * (height + 2))
    for y in range(height):
        free[(y + 1) * wide + 1 : (y + 1) * wide + 1 + width] = image[y].astype(np.uint8).tobytes()
    offsets = [j * wide + i for j, i in steps]
    regions = np.zeros(len(free), dtype=np.int32)
    found = 0
    at = free.find(1)
    while at >= 0:
        found += 1
        free[at] = 0
        cells = [at]
        for cell in cells:
            for offset in offsets:
                if free[cell + offset]:
                    free[cell + offset] = 0
                    cells.append(cell + offset)
        regions[cells] = found
        at = free.find(1, at)
    return regions.reshape(height + 2, wide)[1:-1, 1:-1].copy(), found
