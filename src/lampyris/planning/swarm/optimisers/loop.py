"""The one loop: ask, evaluate, tell, until a stop rule says so.

It serves every swarm: whatever ``ask`` returns is handed to the function as it is, points in a box here,
whole walks over a map elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from lampyris._core.cancellation import checkpoint
from lampyris.errors import SettingError, shown
from lampyris.planning.swarm.optimisers.box import Box, Points, Values

Asked = TypeVar("Asked")
Asked_co = TypeVar("Asked_co", covariant=True)


class Swarm(Protocol[Asked_co]):
    """One run of an optimiser: all its state, and the two calls that move it on."""

    def ask(self) -> Asked_co:
        """Where the function's values are wanted: points (n, d), or anything with n rows."""
        ...

    def tell(self, values: Values) -> None:
        """Take in the values (n,), the greater the better, and move on by one iteration."""
        ...


class Optimiser(Protocol):
    """Frozen settings that can start swarms."""

    def start(self, box: Box, rng: np.random.Generator, first: ArrayLike | None = None) -> Swarm[Points]:
        """A swarm at its first iteration.

        Parameters
        ----------
        box : where to look.
        rng : every draw comes from it.
        first : (m, d), m <= n; where the first m begin. The others are scattered.
        """
        ...


@dataclass(frozen=True, slots=True)
class StoppingRule:
    """When to stop: whichever comes first.

    Parameters
    ----------
    iterations : rounds at most.
    evaluations : values asked for at most; a round that would exceed them is not begun.
    patience : rounds in a row without a better value; None: any number.
    target : good enough (reached or passed in the sense of the search); None: nothing is.

    Raises
    ------
    SettingError : a count below 1, a target that is not a number.
    """

    iterations: int = 250
    evaluations: int | None = None
    patience: int | None = None
    target: float | None = None

    def __post_init__(self) -> None:
        for name in ("iterations", "evaluations", "patience"):
            value = getattr(self, name)
            if value is None and name != "iterations":
                continue
            if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                raise SettingError.of("STOP", name, shown(value), allowed="a whole number >= 1")
        target: object = self.target
        if target is not None and (not isinstance(target, float | int) or target != target):
            raise SettingError.of("STOP", "target", shown(target), allowed="a number, or None")


@dataclass(frozen=True, slots=True, eq=False)
class OptimiserResult(Generic[Asked]):
    """What a search found.

    Parameters
    ----------
    best : the row of what was asked that had the best value (a point (d,)); None if nothing was evaluated.
    value : its value, in the function's own sign.
    iterations, evaluations : rounds, values computed.
    why : ``iterations``, ``evaluations``, ``patience``, ``target`` or ``watch``: the rule that stopped it.
    best_by_iteration : the best value so far after each round, (iterations,).
    """

    best: Any
    value: float
    iterations: int
    evaluations: int
    why: str
    best_by_iteration: tuple[float, ...]


def maximise(
    swarm: Swarm[Asked],
    f: Callable[[Asked], Values],
    stop: StoppingRule | None = None,
    watch: Callable[[], bool] | None = None,
) -> OptimiserResult[Asked]:
    """Look for the greatest value.

    Parameters
    ----------
    swarm : from ``settings.start(box, rng)``.
    f : what was asked, n rows, to n finite values.
    stop : when to stop; None: after 250 rounds.
    watch : asked after each evaluation; True stops before the values are returned to the swarm.
    """
    return _search(swarm, f, stop or StoppingRule(), watch, 1.0)


def minimise(
    swarm: Swarm[Asked],
    f: Callable[[Asked], Values],
    stop: StoppingRule | None = None,
    watch: Callable[[], bool] | None = None,
) -> OptimiserResult[Asked]:
    """Look for the least value: :func:`maximise` of ``-f``; values and target keep the sign of ``f``."""
    return _search(swarm, f, stop or StoppingRule(), watch, -1.0)


def _search(
    swarm: Swarm[Asked],
    f: Callable[[Asked], Values],
    stop: StoppingRule,
    watch: Callable[[], bool] | None,
    sign: float,
) -> OptimiserResult[Asked]:
    best: Any = None
    top = -np.inf
    trace: list[float] = []
    evaluations = waited = 0
    goal = np.inf if stop.target is None else sign * stop.target
    why = "iterations"
    while len(trace) < stop.iterations:
        checkpoint()
        asked = swarm.ask()
        checkpoint()
        many = len(asked)  # type: ignore[arg-type]
        if stop.evaluations is not None and evaluations + many > stop.evaluations:
            why = "evaluations"
            break
        values = sign * np.asarray(f(asked), dtype=np.float64)
        checkpoint()
        if watch is not None and watch():
            why = "watch"
            break
        evaluations += many
        k = int(values.argmax())
        waited = 0 if values[k] > top else waited + 1
        if values[k] > top:
            top, best = float(values[k]), _row(asked, k)
        trace.append(sign * top)
        if top >= goal:
            why = "target"
            break
        swarm.tell(values)
        if stop.patience is not None and waited >= stop.patience:
            why = "patience"
            break
    return OptimiserResult(best, sign * top, len(trace), evaluations, why, tuple(trace))


def _row(asked: Any, k: int) -> Any:
    row = asked[k]
    return row.copy() if isinstance(row, np.ndarray) else row
