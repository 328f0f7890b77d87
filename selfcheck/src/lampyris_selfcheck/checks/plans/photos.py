"""Maps of photographs: thresholds beside all combinations, cells beside a count of their pixels."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lampyris.model.settings.photo import CRITERIA
from lampyris.photos.segment import segment_photo
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally, each
from lampyris_selfcheck.reference.files import photo_thresholds

SWARMS = ("gso", "igso", "pso")


def _photo(rng: np.random.Generator, levels: int) -> np.ndarray:
    """A picture with exactly so many grey levels."""
    values = rng.choice(256, levels, replace=False)
    shares = rng.random(levels) + 0.05
    height, width = (int(n) for n in rng.integers(levels, 24, 2))
    drawn = rng.choice(values, (height, width), p=shares / shares.sum())
    drawn.flat[rng.permutation(drawn.size)[:levels]] = values
    return drawn.astype(np.uint8)


def _thresholds(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("photos", "thresholds", number)
    criterion, k = CRITERIA[number % 3], 1 + number // 3 % 4
    photo = _photo(rng, k + 1 + int(rng.integers(0, 6)))
    by = "exact" if number % 5 else SWARMS[number // 5 % 3]
    made = segment_photo(photo, thresholds=k, criterion=criterion, by=by, seed=number)
    levels, many = np.unique(photo, return_counts=True)
    histogram = dict(zip(levels.tolist(), many.tolist(), strict=True))
    best = photo_thresholds.best(histogram, k, criterion)
    own = photo_thresholds.worth(histogram, made.thresholds, criterion)
    tally.count(by)
    near = 1e-9 * max(1.0, abs(best))
    fault = ""
    if list(made.thresholds) != sorted(set(made.thresholds)) or len(made.thresholds) != k:
        fault = f"thresholds {made.thresholds}"
    elif abs(made.optimum - best) > near or abs(made.score - own) > near:
        fault = f"states {made.score} of {made.optimum}; it is {own} of {best}"
    elif by == "exact" and abs(own - best) > near:
        fault = f"{made.thresholds} are worth {own}, the best {best}"
    elif abs(made.gap - (0.0 if best == 0 else (best - own) / abs(best))) > 1e-9:
        fault = f"states the gap {made.gap} of {own} and {best}"
    if fault:
        tally.fail(number, f"{criterion}, {k}, {by}: {fault}", photo=photo.tolist())


def _cells(ask: Ask, number: int, tally: Tally) -> None:
    rng = ask.rng("photos", "cells", number)
    k = int(rng.integers(1, 4))
    photo = _photo(rng, k + 1 + int(rng.integers(0, 3)))
    cell, share = int(rng.integers(1, 5)), float(rng.choice([0.0, 0.5, 0.75, 1.0]))
    free = sorted(rng.choice(k + 1, int(rng.integers(1, k + 1)), replace=False).tolist())
    settings: dict[str, Any] = {"thresholds": k, "cell": cell, **({"free_share": share} if share else {})}
    made = segment_photo(photo, free=free, **settings)
    bounds = (-1, *made.thresholds, 255)
    height, width = photo.shape
    unknown = np.zeros_like(made.grid.blocked) if made.grid.unknown is None else made.grid.unknown
    if made.grid.blocked.shape != (math.ceil(height / cell), math.ceil(width / cell)):
        tally.fail(number, f"{photo.shape} pixels make {made.grid.blocked.shape} cells of {cell}")
        return
    needed = made.settings.free_share
    for row in range(made.grid.height):
        for column in range(made.grid.width):
            votes = [
                any(bounds[c] < int(level) <= bounds[c + 1] for c in free)
                for level in photo[row * cell : (row + 1) * cell, column * cell : (column + 1) * cell].ravel()
            ]
            yes, no, all_ = votes.count(True), votes.count(False), cell * cell
            is_free = 2 * yes > all_ and yes >= needed * all_
            is_wall = not is_free and 2 * no > all_
            got = (bool(made.grid.blocked[row, column]), bool(unknown[row, column]))
            wanted = (not is_free, not is_free and not is_wall)
            tally.count("free" if is_free else "wall" if is_wall else "unknown")
            if got != wanted:
                what = f"cell {(column, row)}: {yes} of {all_} pixels are free, {no} are not; blocked, unknown: {got}"
                tally.fail(number, what, photo=photo.tolist(), free=free, cell=cell)


JUDGES = {"thresholds": _thresholds, "cells": _cells}


def _run(ask: Ask, part: Part) -> Outcome:
    judge = JUDGES[part.kind]
    return each(part, lambda number, tally: judge(ask, number, tally))


KINDS = {
    "thresholds": Kind(
        "scores, and exact thresholds, beside all combinations of levels", 60, 6_000, 60_000, 200
    ),
    "cells": Kind(
        "each cell is what most of its pixels are, and unknown where none are most", 60, 10_000, 100_000, 500
    ),
}
CHECK = Check(
    "photos",
    ("G37",),
    "maps of photographs have the best thresholds there are, and cells as their pixels say",
    KINDS,
    _run,
)
