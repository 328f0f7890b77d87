"""Theta* and lazy Theta*: a short path by straight lines of any angle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from lampyris._core.settings import check_settings, flag, under_name
from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.any_angle_search import AnyAngleSearch
from lampyris.planning.graph.session import GraphSession


def _session(scene: Scene, name: str, *, lazy: int) -> GraphSession:
    make = partial(AnyAngleSearch, wide=scene.robot.radius > 0, lazy=lazy)
    return GraphSession(scene, name, make, optimal=False)


@dataclass(frozen=True, slots=True)
class ThetaStar:
    """A* whose cells may take the parent of their parent where a straight line leads there.

    Nash, Daniel, Koenig, Felner, "Theta*: any-angle path planning on grids", AAAI 2007, 1177-1183.

    ``Plan.waypoints`` are the turning points, ``Plan.any_angle_length`` the length of the lines between
    them, which the referee sweeps again; ``Plan.path`` is a walk by legal single steps along these lines,
    for everything that drives from cell to cell. The lines keep to the corner rule of the moves, and to
    the room that a robot with a size needs (:mod:`lampyris.kernels.graph.any_angle`); the steps otherwise only
    say which cells are met.

    Guarantees: the lines are never shorter than the straight distance and, without walls between, just as
    long; never longer than the walk along them, and, measured as the crow flies, never longer than the
    shortest walk by single steps (the proof is in the kernel). They need not be the shortest of their
    kind. Over terrain a line goes straight only through cells of one and the same weight, and lengths are
    weighted.
    """

    name: ClassVar[str] = "theta-star"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = "Theta*: a short path by straight lines of any angle."
    source: ClassVar[str] = (
        "Nash, Daniel, Koenig, Felner 2007; lines of sight for discs and over terrain and the walk along the "
        "lines are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return _session(scene, self.name, lazy=0)


@dataclass(frozen=True, slots=True)
class LazyThetaStar:
    """Theta* that looks along a line only when the cell at its end is expanded: fewer looks, nearly as short.

    Nash, Koenig, Tovey, "Lazy Theta*: any-angle path planning and path length analysis in 3D", AAAI 2010,
    147-154.

    Parameters
    ----------
    put_back : what becomes of a cell whose line proves blocked. False, as published: it is expanded at once,
        costlier than expected, though others may be nearer by then; so its lines may be longer than the shortest
        walk by single steps. True (ours): it waits again at the cost that it has then, and the guarantees of
        :class:`ThetaStar` hold. On MovingAI maps that took no longer, and what it found was no longer either.

    Fewer tests need not take less time: with lines this cheap it takes 0.9 to 1.8 times as long as
    :class:`ThetaStar`, by map (``benchmarks/bench_query.py``), because costs assumed too low lead it astray.

    Raises
    ------
    SettingError : ``put_back`` is not true or false.
    """

    put_back: bool = flag(True, title="put blocked cells back")

    name: ClassVar[str] = "lazy-theta-star"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = "Lazy Theta*: as Theta*, looking along a line only when it matters."
    source: ClassVar[str] = (
        "Nash, Koenig, Tovey 2010; putting cells back, lines of sight for discs and over terrain and the "
        "walk along the lines are ours."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return _session(scene, self.name, lazy=2 if self.put_back else 1)
