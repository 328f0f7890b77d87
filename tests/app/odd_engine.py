"""An engine that can also be asked to misbehave, for tests of those who hold it."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import tempfile
import time
import types
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from lampyris.app.engine import engine
from lampyris.app.engine.frames import frame, json_frame

Look = Callable[[], None]


def spin(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Work for ever and never look whether anybody waits."""
    yield json_frame("H", {})
    while True:
        pass


def wait(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Do nothing until cancelled."""
    yield json_frame("H", {"job": question["job"], "pid": os.getpid()})
    while True:
        look()
        time.sleep(0.005)


def sleep(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Do nothing, and never look."""
    yield json_frame("H", {"job": question["job"], "pid": os.getpid()})
    time.sleep(1000)


def loop(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """One compiled loop that ends only when the job is cancelled; the file's first byte is 1 once it runs."""
    import numpy as np
    from odd_kernel import forever

    yield json_frame("H", {"job": question["job"], "pid": os.getpid()})
    forever(np.asarray(np.memmap(question["file"], dtype=np.uint8, mode="r+", shape=(1,))))
    yield json_frame("Z", {"pid": os.getpid()})


def mute(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Never say anything."""
    time.sleep(1000)
    yield b""


def grow(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Take 10 GB."""
    held = []
    while len(held) < 160:
        held.append(bytearray(2**26))
    yield json_frame("Z", {"held": len(held)})


def fork(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Start others that do not end by themselves, tell their numbers, and go on as is said."""
    line = [sys.executable, "-c", "import time; time.sleep(1000)"]
    some = [subprocess.Popen(line, close_fds=question["close"]).pid for _ in range(3)]
    yield json_frame("H", {"job": question["job"], "pid": os.getpid(), "some": some})
    if question["then"] == "end":
        yield json_frame("Z", {})
        return
    yield from {"crash": crash, "spin": spin, "sleep": sleep, "wait": wait, "tell": tell}[question["then"]](
        question, look
    )


def tell(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Never stop answering."""
    while True:
        yield json_frame("P", {"job": question["job"]})


def crash(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """End in the middle of an answer."""
    yield json_frame("H", {})
    os._exit(3)


def pour(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """A hundred megabytes, and how much of them has left to stderr's file."""
    for k in range(100):
        yield frame("B", bytes(2**20))
        with open(question["file"], "w") as out:
            out.write(str(k + 1))
    yield json_frame("Z", {})


def forge(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Bytes that are no answer."""
    os.write(int(os.environ["ODD_OUT"]), b"\xff" * 64)
    yield json_frame("Z", {})


def fault(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Something nobody thought of."""
    raise ZeroDivisionError("on purpose")
    yield b""


def late(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Answer, and once more after the end."""
    yield json_frame("Z", {})
    piece = json_frame("Z", {"said": "late"})
    line = struct.pack("<II", 0, question["job"]) + struct.pack("<II", len(piece), question["job"]) + piece
    os.write(int(os.environ["ODD_OUT"]), line)


def place(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """Where temporary files go."""
    yield json_frame("Z", {"place": tempfile.gettempdir()})


def quick(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """At once."""
    yield json_frame("Z", {"pid": os.getpid(), "said": question.get("said")})


def flood(question: Mapping[str, Any], look: Look) -> Iterator[bytes]:
    """More than anybody reads."""
    while True:
        look()
        yield frame("B", bytes(2**20))


if __name__ == "__main__":
    os.environ["ODD_OUT"] = str(os.dup(1))
    kinds = (spin, wait, sleep, loop, mute, grow, fork, crash, pour, forge, fault, late, place, quick)
    verbs = {kind.__name__: kind for kind in kinds}
    # As the server calls them, which asks for nothing else.
    verbs |= {"plan": quick, "layer": wait, "simulate": flood, "compare": wait, "make": quick}
    # In the place of the real work, whose import takes most of a second.
    odd = types.ModuleType("lampyris.app.engine.work")
    odd.answer = lambda question, look: verbs[question["verb"]](question, look)  # type: ignore[attr-defined]
    odd.warm = lambda question, look: iter(())  # type: ignore[attr-defined]
    import lampyris.app

    sys.modules[odd.__name__] = lampyris.app.engine.work = odd  # type: ignore[attr-defined]
    engine.main()
    sys.exit(0)
