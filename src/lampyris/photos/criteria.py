"""What thresholds are worth: three criteria, each a sum over classes of grey levels.

With the pixels P_c of a class, the sum S_c of their levels, and N and S the same of all pixels:

* ``otsu``: sum of ``S_c^2 / P_c``, less what one class has (``S^2 / N``), over N: the variance between classes.
  N. Otsu, IEEE Trans. SMC 9(1):62-66, 1979.
* ``kapur``: sum of the entropies of the levels within each class. J. N. Kapur, P. K. Sahoo, A. K. C. Wong, CVGIP
  29(3):273-285, 1985.
* ``cross-entropy``: sum of ``S_c ln(S_c / P_c)``, less what one class has, over N: the cross-entropy between the
  picture and its classes' means falls by as much. C. H. Li, C. K. Lee, Pattern Recognition 26(4):617-625, 1993.

All are to be maximised. Sums over pixels are exact whole numbers; a class without pixels is worth minus infinity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core.elementary import log
from lampyris.model.photos.segmented_photo import LEVELS

Worth = NDArray[np.float64]
"""float64, (256, 257): [a, b] is what the class of the levels a to b - 1 is worth."""
Levels = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Classes:
    """Pixels and sums of levels of all classes.

    Parameters
    ----------
    histogram : int64 (256,).
    many, total : int64 (256, 257); P and S of the levels a to b - 1; 0 where b <= a.
    """

    histogram: Levels
    many: Levels
    total: Levels


def classes_of(histogram: Levels) -> Classes:
    """Pixels and sums of every class, from two prefix sums."""
    levels = np.arange(LEVELS, dtype=np.int64)
    many, total = (np.concatenate(([0], np.cumsum(h))) for h in (histogram, histogram * levels))
    inside = np.arange(LEVELS + 1) > levels[:, np.newaxis]
    P = np.where(inside, many[np.newaxis] - many[:-1, np.newaxis], 0)
    S = np.where(inside, total[np.newaxis] - total[:-1, np.newaxis], 0)
    return Classes(histogram, P, S)


def worth_of(histogram: Levels, criterion: str) -> Worth:
    """What each class is worth; see :data:`Worth`."""
    classes = classes_of(histogram)
    worth = _WORTH[criterion](classes)
    worth[classes.many == 0] = -np.inf
    return worth


def _otsu(classes: Classes) -> Worth:
    # N S_c - S P_c is exact: 2^24 pixels of 255 each make 2^56.
    n, s = int(classes.many[0, -1]), int(classes.total[0, -1])
    away = (n * classes.total - s * classes.many).astype(np.float64) / n
    return away * away / np.maximum(classes.many, 1) / n


def _kapur(classes: Classes) -> Worth:
    h = classes.histogram.astype(np.float64)
    each = h * log(np.maximum(h, 1.0))
    beyond = np.arange(LEVELS) >= np.arange(LEVELS)[:, np.newaxis]
    inner = np.zeros((LEVELS, LEVELS + 1))
    inner[:, 1:] = np.cumsum(np.where(beyond, each, 0.0), axis=1)
    many = np.maximum(classes.many, 1).astype(np.float64)
    return np.maximum(log(many) - inner / many, 0.0)


def _cross_entropy(classes: Classes) -> Worth:
    n, s = int(classes.many[0, -1]), float(classes.total[0, -1])
    total = classes.total.astype(np.float64)
    ratio = (total * n) / (np.maximum(classes.many, 1) * max(s, 1.0))
    return total * np.where(total > 0, log(np.where(total > 0, ratio, 1.0)), 0.0) / n


_WORTH = {"otsu": _otsu, "kapur": _kapur, "cross-entropy": _cross_entropy}


def scores(worth: Worth, thresholds: Levels) -> NDArray[np.float64]:
    """What rows of thresholds (n, k), each ascending, are worth; float64 (n,), minus infinity with an empty class.

    Classes are added from the brightest to the darkest, as by the dynamic programme, so that equal thresholds have
    equal scores.
    """
    n = len(thresholds)
    ends = np.concatenate((np.full((n, 1), -1), thresholds, np.full((n, 1), LEVELS - 1)), axis=1) + 1
    total = np.zeros(n)
    for c in range(thresholds.shape[1], -1, -1):
        a, b = ends[:, c], ends[:, c + 1]
        total = np.where(b > a, worth[np.minimum(a, LEVELS - 1), b], -np.inf) + total
    return total


def score(worth: Worth, thresholds: Sequence[int]) -> float:
    """What some thresholds are worth."""
    return float(scores(worth, np.array([thresholds], dtype=np.int64))[0])
