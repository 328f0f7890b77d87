"""Two calls at once on one session: the second is refused, and nothing comes of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from threading import Thread

import numpy as np

from lampyris.errors import BusyError, InputError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner, Session
from lampyris.testing.questions import Question, ask
from lampyris.typing import Cell

HANGS = 60.0
"""Seconds after which a call that should have been refused at once is said to hang."""


class Meanwhile(Change):
    """A change during the reading of which something else happens, once.

    Parameters
    ----------
    robot : see :class:`Change`.
    what : called when a session first reads any part of the change.
    """

    def __init__(self, robot: Cell, what: Callable[[], None]) -> None:
        super().__init__(robot=robot)
        object.__setattr__(self, "_todo", [what])

    def __getattribute__(self, name: str) -> object:
        todo: list[Callable[[], None]] = object.__getattribute__(self, "_todo") if name in _READ else []
        if todo:
            todo.pop()()
        return object.__getattribute__(self, name)


_READ = frozenset(Change.__dataclass_fields__)


def check_overlap(planner: Planner) -> None:
    """Call a session while it is at work: from another thread, then from within the call.

    Raises
    ------
    AssertionError : the second call is not refused with ``BusyError``, or one of the session's answers is
        wrong afterwards.
    """
    walls = np.zeros((5, 6), dtype=bool)
    walls[1:4, 3] = True
    scene = Scene(Grid(walls), (0, 2), (5, 2))
    session = planner.open(scene, np.random.default_rng(0))
    for label, call in (("in another thread", _elsewhere), ("from within", _try)):
        came: list[object] = []

        def second(call: Callable[[Session, list[object]], None] = call, came: list[object] = came) -> None:
            call(session, came)

        question = Question(scene, scene.grid, scene.start, label=f"a call while another is called {label}")
        ask(planner, session, question, Meanwhile(scene.start, second))
        if not came:
            raise AssertionError(f"{planner.name}: plan does not look at the change it is given")
        if not isinstance(came[0], BusyError):
            raise AssertionError(
                f"{planner.name}: a second call {label} comes to {came[0]!r}, not to a BusyError; "
                "derive the session from lampyris.planning.base.SessionBase"
            )
    with suppress(InputError):
        session.plan(Change(robot=(scene.grid.width, 0)))
    question = Question(scene, scene.grid, scene.start, label="after a call that raised")
    ask(planner, session, question, Change(scene.start))


def _try(session: Session, came: list[object]) -> None:
    try:
        came.append(session.plan())
    except Exception as error:  # whatever it is, it is shown
        came.append(error)


def _elsewhere(session: Session, came: list[object]) -> None:
    """The same in a thread of its own."""
    thread = Thread(target=_try, args=(session, came), daemon=True)
    thread.start()
    thread.join(HANGS)
    if thread.is_alive():
        came.append("no end")
