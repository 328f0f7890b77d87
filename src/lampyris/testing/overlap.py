"""Two calls at once on one session: the second is refused and has no effect."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from threading import Thread
from typing import Any

import numpy as np

from lampyris.errors import BusyError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner, Session
from lampyris.testing.questions import Failures, Question, ask, describe

HANGS = 60.0
"""Seconds after which a call that should have been refused at once counts as hanging."""


class Meanwhile(Change):
    """A change that calls a function when it is first read.

    Parameters
    ----------
    call : called once, when a session first reads any part of the change; None, as in a copy by
        ``dataclasses.replace``: nothing is called.
    parts : see :class:`Change`.
    """

    def __init__(self, call: Callable[[], None] | None = None, **parts: Any) -> None:
        super().__init__(**parts)
        object.__setattr__(self, "_todo", [] if call is None else [call])

    def __getattribute__(self, name: str) -> object:
        todo: list[Callable[[], None]] = object.__getattribute__(self, "_todo") if name in _READ else []
        if todo:
            todo.pop()()
        return object.__getattribute__(self, name)


_READ = frozenset(Change.__dataclass_fields__)


def check_overlap(planner: Planner, failures: Failures) -> None:
    """Call a session during a call: from another thread, then from within.

    A broken rule: the second call is not refused with ``BusyError``, or one of the session's answers is wrong
    afterwards.
    """
    walls = np.zeros((5, 6), dtype=bool)
    walls[1:4, 3] = True
    scene = Scene(Grid(walls), (0, 2), (5, 2))
    session = planner.open(scene, np.random.default_rng(0))
    for label, call in (("in another thread", _call_in_thread), ("from within", _call)):
        answers: list[object] = []

        def second(call: Callable[[Session, list[object]], None] = call, to: list[object] = answers) -> None:
            call(session, to)

        question = Question(scene, scene.grid, scene.start, label=f"a call during a call {label}")
        ask(planner, session, question, Meanwhile(second, robot=scene.start), failures)
        if not answers:
            failures.add("plan does not read the change it is given")
        elif not isinstance(answers[0], BusyError):
            failures.add(
                f"a second call {label} returns {describe(answers[0])}, not a BusyError; derive the session from "
                "lampyris.planning.base.SessionBase"
            )
    with suppress(Exception):
        session.plan(Change(robot=(scene.grid.width, 0)))
    question = Question(scene, scene.grid, scene.start, label="after a call that raised")
    ask(planner, session, question, Change(scene.start), failures)


def _call(session: Session, answers: list[object]) -> None:
    try:
        answers.append(session.plan())
    except Exception as error:  # whatever it is, it is shown
        answers.append(error)


def _call_in_thread(session: Session, answers: list[object]) -> None:
    thread = Thread(target=_call, args=(session, answers), daemon=True)
    thread.start()
    thread.join(HANGS)
    if thread.is_alive():
        answers.append(f"nothing within {HANGS:g} s")
