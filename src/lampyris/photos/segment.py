"""segment_photo: from a photograph to a grid."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import checkpoint
from lampyris._core.limits import MAX_CELLS
from lampyris._core.scalars import MAX_SEED, SEED_RANGE, is_whole
from lampyris.errors import InputError, SettingError, plural, shown
from lampyris.io.photos.read import GreyPhoto, median_of, photo_of, read_photo
from lampyris.kernels import loading
from lampyris.model.grid import Grid
from lampyris.model.photos.segmented_photo import LEVELS, SegmentedPhoto
from lampyris.model.settings.photo import PhotoSettings
from lampyris.photos.cells import cells_of
from lampyris.photos.criteria import Levels, score, worth_of
from lampyris.photos.exact import exact_thresholds
from lampyris.photos.swarm import ROUNDS, SWARM, swarm_thresholds

FREE = "bright"
"""Which classes are free where nothing else is said."""


def segment_photo(
    photo: str | os.PathLike[str] | np.ndarray[Any, Any],
    *,
    free: str | int | Sequence[int] = FREE,
    resolution: float = 1.0,
    seed: int = 0,
    max_cells: int = MAX_CELLS,
    **settings: Any,
) -> SegmentedPhoto:
    """Make a map from a photograph: thresholds divide its grey levels into classes, and some classes are free.

    Parameters
    ----------
    photo : a JPEG, PNG, BMP or PGM file, or uint8 of shape (height, width) or (height, width, 3).
    free : ``bright`` (the brightest class), ``dark`` (the darkest), a class or several; 0 is the darkest.
    resolution : metres a cell.
    seed : of the swarm; ``exact`` draws nothing.
    max_cells : more pixels than this are refused, from the header.
    **settings : see :class:`lampyris.model.settings.photo.PhotoSettings`: ``thresholds``, ``criterion``, ``by``,
        ``channel``, ``median``, ``cell``, ``free_share``.

    Raises
    ------
    FileError : the file is missing or cannot be read.
    LimitError : too many pixels or bytes.
    SettingError : a setting out of its range, classes that do not exist or are all there are.
    InputError : ``PHOTO_LEVELS``: fewer grey levels than classes. ``THRESHOLDS``: a swarm found none.

    Examples
    --------
    >>> import numpy as np
    >>> floor = np.full((40, 60), 200, dtype=np.uint8)
    >>> floor[10:30, 25:35] = 30
    >>> made = segment_photo(floor, cell=5, resolution=0.05)
    >>> made.thresholds, made.grid.blocked.shape, int(made.grid.blocked.sum())
    ((30,), (8, 12), 8)
    """
    wanted = _settings(settings)
    if not is_whole(seed) or not 0 <= seed <= MAX_SEED:
        raise SettingError("SEED", shown(seed), where="seed", allowed=SEED_RANGE)
    chosen = free_classes(free, wanted.thresholds)
    Grid(np.zeros((1, 1), dtype=np.bool_), resolution=resolution)  # refuses a resolution before any work
    grey: GreyPhoto
    if isinstance(photo, str | os.PathLike):
        grey = read_photo(photo, wanted.channel, max_cells=max_cells)
    else:
        grey = photo_of(photo, wanted.channel, max_cells=max_cells)
    checkpoint()
    levels = median_of(grey.levels, wanted.median)
    checkpoint()
    seen = levels if grey.clear is None else levels[~grey.clear]
    histogram = np.bincount(index_array(seen.ravel()), minlength=LEVELS).astype(np.int64)
    where = grey.name or "photo"
    used = int(np.count_nonzero(histogram))
    if used <= wanted.thresholds:
        found = f"{plural(used, 'grey level')}, too few for {plural(wanted.thresholds, 'threshold')}"
        allowed = f"at most {plural(used - 1, 'threshold')}" if used > 1 else "two grey levels or more"
        raise InputError("PHOTO_LEVELS", found, where=where, allowed=allowed, setting="thresholds")
    thresholds, best, worth, seconds = _search(histogram, wanted, seed, where)
    checkpoint()
    blocked, unknown = cells_of(levels, grey.clear, thresholds, chosen, wanted.cell, wanted.free_share)
    grid = Grid(blocked, unknown=unknown if unknown.any() else None, resolution=resolution, name=grey.name)
    histogram.setflags(write=False)
    height, width = levels.shape
    return SegmentedPhoto(
        grid, thresholds, chosen, score(worth, thresholds), score(worth, best), histogram, width, height, wanted,
        grey.notes, seconds,
    )  # fmt: skip


def _settings(given: dict[str, Any]) -> PhotoSettings:
    from lampyris._core.settings import settings_of
    from lampyris.errors import UnknownSettingError, did_you_mean

    known = settings_of(PhotoSettings)
    for name in given:
        if name not in known:
            raise UnknownSettingError(
                "SETTING",
                f"no setting {shown(name)}",
                where=name,
                allowed=", ".join(known),
                todo=did_you_mean(name, known),
                setting=name,
            )
    return PhotoSettings(**given)


def free_classes(free: object, thresholds: int) -> tuple[int, ...]:
    """The classes that are free, ascending: ``bright``, ``dark``, a class, or several of 0 (dark) to ``thresholds``.

    Raises
    ------
    SettingError : ``FREE_CLASSES``: no such class, or all of them.
    """
    words = {"bright": (thresholds,), "dark": (0,)}
    given: Sequence[Any] = free if isinstance(free, list | tuple) else (free,)
    if isinstance(free, str):
        given = words.get(free, ())
    chosen = sorted({int(c) for c in given if is_whole(c, 0, thresholds)})
    if not 0 < len(chosen) == len(given) <= thresholds:
        allowed = f"bright, dark, or some but not all of the classes 0 (darkest) to {thresholds}, each once"
        raise SettingError("FREE_CLASSES", shown(free), where="free", allowed=allowed)
    return tuple(chosen)


def _search(
    histogram: Levels, wanted: PhotoSettings, seed: int, where: str
) -> tuple[tuple[int, ...], tuple[int, ...], Any, float]:
    """Thresholds, the best there are, what classes are worth, and CPU seconds of the search that was asked for."""
    began = loading.cpu()
    worth = worth_of(histogram, wanted.criterion)
    best = exact_thresholds(worth, wanted.thresholds)
    if wanted.by == "exact":
        return best, best, worth, loading.cpu() - began
    began = loading.cpu()
    found = swarm_thresholds(worth, wanted.thresholds, wanted.by, np.random.default_rng(seed))
    if found is None:
        what = f"{SWARM} {'particles' if wanted.by == 'pso' else 'glowworms'} found no {plural(wanted.thresholds, 'threshold')}"
        what += f" with pixels in every class in {ROUNDS} rounds"
        raise InputError("THRESHOLDS", what, where=where, allowed="exact finds them", setting="by")
    return found, best, worth, loading.cpu() - began
