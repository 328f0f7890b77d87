"""Known: fields of the last few places, so that what is asked again while something is dragged is available."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

from lampyris.model.scene import Scene
from lampyris.report.data.measures import Known
from lampyris.study.execution import verify as judge
from lampyris.study.execution.site import Place

T = TypeVar("T")
KEPT: Final = 8

_kept: dict[tuple[Any, ...], tuple[Any, Any]] = {}


def keep(key: tuple[Any, ...], of: object, make: Callable[[], T]) -> T:
    """What ``make`` makes, or made last for this key; of the last few keys.

    Parameters
    ----------
    of : a noun whose identity is a part of the key; it is kept as well, so that no other takes its place.
    """
    whole = (id(of), *key)
    found = _kept.pop(whole, None)
    made: T = make() if found is None else found[1]
    _kept[whole] = (of, made)
    while len(_kept) > KEPT:
        del _kept[next(iter(_kept))]
    return made


def place_facts(scene: Scene) -> Known:
    """Facts about a place that the measures of a run need."""
    key = ("known", scene.start, scene.goal, scene.moves.name, scene.robot.radius)
    return keep(key, scene.grid, lambda: judge.place_facts(Place(scene)))
