"""The best thresholds there are, by dynamic programming over classes and levels.

``best_m(a)``, the greatest worth of the levels from a on in m classes, is the maximum over b of what the class a to
b - 1 is worth and ``best_(m-1)(b)``: 256^2 sums for each class. N. Otsu's own multilevel search takes 256^k.
"""

from __future__ import annotations

import numpy as np

from lampyris.model.photos.segmented_photo import LEVELS
from lampyris.photos.criteria import Worth


def exact_thresholds(worth: Worth, k: int) -> tuple[int, ...]:
    """The k thresholds that are worth the most; of several such the first in lexicographic order.

    Parameters
    ----------
    worth : see :data:`lampyris.photos.criteria.Worth`; k + 1 levels or more have pixels.
    k : 1 or more.
    """
    best = np.append(worth[:, LEVELS], -np.inf)
    ends = []
    for _ in range(k):
        tried = worth + best[np.newaxis]
        ends.append(tried.argmax(axis=1))
        best = np.append(tried.max(axis=1), -np.inf)
    found, a = [], 0
    for end in reversed(ends):
        a = int(end[a])
        found.append(a - 1)
    return tuple(found)
