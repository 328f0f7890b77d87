"""Fields of many goals on one map, several at a time: the kernels let go of the interpreter."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from lampyris._core import cancellation
from lampyris._core.defaults import GAMMA, RHO
from lampyris._core.scalars import is_whole
from lampyris._core.system import processors
from lampyris.errors import SettingError, of_kind, shown
from lampyris.model.field import Field
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.planning.field.cost_tables import KINDS, cost_tables
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.solve import solve
from lampyris.typing import BoolGrid, ByteGrid, Cell

_Found = TypeVar("_Found")


@overload
def solve_fields(
    scene: Scene,
    goals: Iterable[Cell],
    *,
    rho: float = RHO,
    gamma: float = GAMMA,
    workers: int | None = None,
    dtype: None = None,
) -> Iterator[Field]: ...
@overload
def solve_fields(
    scene: Scene,
    goals: Iterable[Cell],
    *,
    rho: float = RHO,
    gamma: float = GAMMA,
    workers: int | None = None,
    dtype: str,
) -> Iterator[NDArray[Any]]: ...
def solve_fields(
    scene: Scene,
    goals: Iterable[Cell],
    *,
    rho: float = RHO,
    gamma: float = GAMMA,
    workers: int | None = None,
    dtype: str | None = None,
) -> Iterator[Field] | Iterator[NDArray[Any]]:
    """The fields of many goals on the map of one scene, in the order of the goals; the scene's own goal is not used.

    For tables of distances, heuristics and the choice of the nearest goal::

        nearest = min(lampyris.solve_fields(scene, chargers), key=lambda field: field.cost[y, x])

    Parameters
    ----------
    scene : its map, moves and robot.
    goals : cells; drawn from as fields are taken.
    rho, gamma : as for :func:`lampyris.solve_field`.
    workers : how many threads, 1 or more; None for one for each processor of this process.
    dtype : None for fields; ``uint16`` or ``uint32`` for arrays (height, width) of this type, the exact costs alone
        (:attr:`lampyris.Field.exact`); cells that cannot reach the goal hold the type's greatest number. For steps of
        ``four-connected`` moves on plain ground this is faster than fields. Exact costs of ``octile`` moves fit into
        neither.

    Raises
    ------
    SettingError : a setting out of its range.
    SceneError : a goal outside the map, when its field's turn has come.
    LimitError : ``COST_TABLE``: a cost does not fit into ``dtype``.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> fields = lampyris.solve_fields(scene, [(8, 2), (1, 8)])
    >>> [field.goal for field in fields]
    [(8, 2), (1, 8)]
    """
    of_kind("scene", scene, Scene)
    if dtype is not None:
        if dtype not in KINDS:
            raise SettingError("DTYPE", shown(dtype), where="dtype", allowed=", ".join(KINDS) + ", or None")
        _check_workers(workers)
        jobs = cost_tables(
            free_space(scene), moves_for(scene), goals, terrain=scene.grid.terrain, kind=np.dtype(dtype)
        )
        return _flat(_in_order(jobs, workers or processors()))
    return solve_many(
        free_space(scene), moves_for(scene), goals, terrain=scene.grid.terrain, rho=rho, gamma=gamma,
        workers=workers,
    )  # fmt: skip


def solve_many(
    free: BoolGrid,
    moves: Moves,
    goals: Iterable[Cell],
    *,
    terrain: ByteGrid | None = None,
    rho: float = RHO,
    gamma: float = GAMMA,
    workers: int | None = None,
) -> Iterator[Field]:
    """The field of each goal, in the order of the goals, as :func:`lampyris.planning.field.solve.solve` gives it.

    A thread solves a field at a time; two fields more than there are workers are held at the most, so that
    goals may be as many as one likes.

    Parameters
    ----------
    free, moves, terrain, rho, gamma : as for :func:`lampyris.planning.field.solve.solve`. A map that is written to
        meanwhile is read as it is then: freeze it, or it is copied for each field.
    goals : cells; drawn from as fields are taken.
    workers : how many threads, 1 or more; None for one for each processor of this process.

    Raises
    ------
    SettingError : fewer than one worker; and what ``solve`` raises, when its field's turn has come.
    """
    _check_workers(workers)
    jobs = (partial(solve, free, moves, goal, terrain=terrain, rho=rho, gamma=gamma) for goal in goals)
    return _in_order(jobs, workers or processors())


def _check_workers(workers: int | None) -> None:
    if workers is not None and not is_whole(workers, 1):
        raise SettingError("WORKERS", shown(workers), where="workers", allowed="1 or more, or None")


def _flat(lists: Iterator[list[NDArray[Any]]]) -> Iterator[NDArray[Any]]:
    for some in lists:
        yield from some


def _in_order(jobs: Iterable[Callable[[], _Found]], workers: int) -> Iterator[_Found]:
    ahead: deque[tuple[Future[_Found], Callable[[], _Found]]] = deque()
    with ThreadPoolExecutor(workers, thread_name_prefix="lampyris-field") as pool:
        try:
            for one in jobs:
                cancellation.word()  # made here, where one thread asks for it
                ahead.append((pool.submit(_watched, cancellation.watch(), one), one))
                if len(ahead) > workers + 1:
                    yield _taken(*ahead.popleft())
            while ahead:
                yield _taken(*ahead.popleft())
        finally:
            # Anyone who stops taking fields shall not wait for those that nobody will see.
            for future, _ in ahead:
                future.cancel()


def _watched(watch: cancellation.CancelScope | None, one: Callable[[], _Found]) -> _Found:
    """A field, given up when the call that asked for it is to stop."""
    with cancellation.under(watch):
        return one()


def _taken(future: Future[_Found], one: Callable[[], _Found]) -> _Found:
    try:
        return future.result()
    except cancellation.Cancelled:
        cancellation.checkpoint()
        return one()  # the call that asked for it is over, and another one takes it
