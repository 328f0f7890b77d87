"""Fields of many goals on one map, several at a time: the kernels let go of the interpreter."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

from lampyris._core import cancellation
from lampyris._core.defaults import GAMMA, RHO
from lampyris._core.processors import processors
from lampyris._core.scalars import is_whole
from lampyris.errors import SettingError, of_kind, shown
from lampyris.model.field import Field
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.solve import solve
from lampyris.typing import BoolGrid, ByteGrid, Cell


def solve_fields(
    scene: Scene,
    goals: Iterable[Cell],
    *,
    rho: float = RHO,
    gamma: float = GAMMA,
    workers: int | None = None,
) -> Iterator[Field]:
    """The fields of many goals on the map of one scene, in the order of the goals: its own goal is not used.

    For tables of distances, heuristics and the choice of the nearest goal::

        nearest = min(lampyris.solve_fields(scene, chargers), key=lambda field: field.cost[y, x])

    Parameters
    ----------
    goals : cells; drawn from as fields are taken.
    rho, gamma : as for :func:`lampyris.solve_field`.
    workers : how many threads, 1 or more; None for one for each processor of this process.

    Raises
    ------
    SettingError : a setting out of its range.
    SceneError : a goal outside the map, when its field's turn has come.
    """
    of_kind("scene", scene, Scene)
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
    if workers is not None and not is_whole(workers, 1):
        raise SettingError("WORKERS", shown(workers), where="workers", allowed="1 or more, or None")
    return _solve_many(free, moves, goals, terrain, rho, gamma, workers or processors())


def _solve_many(
    free: BoolGrid,
    moves: Moves,
    goals: Iterable[Cell],
    terrain: ByteGrid | None,
    rho: float,
    gamma: float,
    workers: int,
) -> Iterator[Field]:
    ahead: deque[tuple[Future[Field], Callable[[], Field]]] = deque()
    with ThreadPoolExecutor(workers, thread_name_prefix="lampyris-field") as pool:
        try:
            for goal in goals:
                one = partial(solve, free, moves, goal, terrain=terrain, rho=rho, gamma=gamma)
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


def _watched(watch: cancellation.CancelScope | None, one: Callable[[], Field]) -> Field:
    """A field, given up when the call that asked for it is to stop."""
    with cancellation.under(watch):
        return one()


def _taken(future: Future[Field], one: Callable[[], Field]) -> Field:
    try:
        return future.result()
    except cancellation.Cancelled:
        cancellation.checkpoint()
        return one()  # the call that asked for it is over, and another one takes it
