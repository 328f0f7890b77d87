"""Criteria of thresholds between grey levels, from their definitions, level by level."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise


def worth(histogram: Mapping[int, int], thresholds: Sequence[int], criterion: str) -> float:
    """What thresholds are worth; minus infinity with an empty class. ``histogram``: pixels of each level that occurs."""
    pixels = sum(histogram.values())
    mean = sum(level * many for level, many in histogram.items()) / pixels
    total = 0.0
    for low, high in pairwise((-1, *thresholds, 255)):
        inside = {level: many for level, many in histogram.items() if low < level <= high}
        many = sum(inside.values())
        if not many:
            return -math.inf
        own = sum(level * one for level, one in inside.items()) / many
        if criterion == "otsu":
            total += many / pixels * (own - mean) ** 2
        elif criterion == "kapur":
            total -= sum(one / many * math.log(one / many) for one in inside.values())
        elif own > 0:
            total += many / pixels * own * math.log(own / mean)
    return total


def best(histogram: Mapping[int, int], k: int, criterion: str) -> float:
    """The greatest worth of k thresholds: each may be taken to be a level that occurs."""
    return max(worth(histogram, some, criterion) for some in combinations(sorted(histogram), k))
