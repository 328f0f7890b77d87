"""Children of one process, each told of Ctrl-C at another moment of its first work with a library.

    python interrupted_child.py WORK MOMENTS

Moments are counted in audit events (an import, a file opened, code compiled), so that they are the same in
every run. For each moment a line of JSON: what the first call came to, and what the second did.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import lampyris
import lampyris.api
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.io.text.strict_yaml import read_yaml
from lampyris.kernels import _jit
from lampyris.model.path import path_of
from lampyris.report.pictures.plan_picture import draw_plan

NEVER = 10**9


def scene(side: int) -> lampyris.Scene:
    blocked = np.random.default_rng(1).random((side, side)) < 0.1
    blocked[0, 0] = blocked[-1, -1] = False
    return lampyris.Scene(lampyris.Grid(blocked), (0, 0), (side - 1, side - 1))


def plan() -> str:
    """A plan in compiled code: numba is imported, machine code loaded or made."""
    return repr(lampyris.plan(SCENE, "jps").cost)


def regions() -> str:
    """SciPy's image functions are imported."""
    return repr(int(keep_largest(SCENE.grid.blocked).sum()))


def yaml() -> str:
    return repr(read_yaml(b"a: [1, 2]", "-").data)


def picture() -> str:
    """matplotlib is imported."""
    folder = tempfile.mkdtemp()
    draw_plan(SCENE.grid, STRAIGHT, out=f"{folder}/a.png")
    return str(len(Path(folder, "a.png").read_bytes()))


SCENE = scene(40)
PATH = np.array([(k, k) for k in range(2)])
STRAIGHT = lampyris.Plan(lampyris.Status.FOUND, "test", path_of(PATH, SCENE.moves))
WORK: dict[str, Callable[[], str]] = {"plan": plan, "regions": regions, "yaml": yaml, "picture": picture}


def told_at(moment: int, work: Callable[[], str]) -> dict[str, object]:
    """What comes of the work when a SIGINT comes at a moment of it, and what comes of it after that."""
    events, on = 0, True

    def hook(event: str, _: object) -> None:
        nonlocal events, on
        if on:
            events += 1
            if events == moment:
                signal.raise_signal(signal.SIGINT)

    sys.addaudithook(hook)
    try:
        first = work()
    except BaseException as error:
        first = type(error).__name__
    on = False
    try:
        second = work()
    except BaseException as error:
        second = f"{type(error).__name__}: {error}"
    return {"moment": moment, "events": events, "first": first, "second": second}


def in_a_child(moment: int, work: Callable[[], str]) -> dict[str, object]:
    """The same in a process of its own that shares what is imported."""
    out, into = os.pipe()
    child = os.fork()
    if not child:
        os.write(into, json.dumps(told_at(moment, work)).encode())
        os._exit(0)
    os.close(into)
    with os.fdopen(out) as said:
        text = said.read()
    os.waitpid(child, 0)
    return json.loads(text) if text else {"moment": moment, "second": "the process died"}


def main() -> None:
    # In a shell's background job SIGINT is ignored, and children inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    _jit.prefer_compiled()
    work, moments = WORK[sys.argv[1]], int(sys.argv[2])
    in_a_child(NEVER, work)  # what is compiled is kept for the others, if it can be
    whole = in_a_child(NEVER, work)
    print(json.dumps(whole))
    for k in range(moments):
        print(json.dumps(in_a_child(1 + int(whole["events"]) * (2 * k + 1) // (2 * moments), work)))


main()
