"""Decode: an untrusted map file becomes cells in a process that can do nothing else.

The process has little memory and few seconds, may open no file but those it was sent (in a private folder of
its own) and code, starts nothing and connects to nothing. What it sends back is plain data of a known size
that is checked again.

What is sent: u32 count; each u16 length of a name, the name in UTF-8, u32 length, bytes (little endian).
What comes back is one line of JSON: ``{"map": ...}`` or ``{"error": ...}``.
"""

from __future__ import annotations

import json
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Container
from pathlib import Path
from typing import Any, Final

from lampyris._core.system import ran_out_of_seconds, was_killed
from lampyris.app.engine.frames import fault_of
from lampyris.app.engine.names import check_file_name, is_plain_name, shown_name
from lampyris.errors import FileError, InternalFault, LampyrisError, LimitError

SECONDS: Final = 10
MEMORY: Final = 2**30
WALL: Final = 20.0
MAX_BYTES: Final = 2**26
MAX_FILES: Final = 16
MAX_ANSWER: Final = 2**26
AT_ONCE: Final = 2
"""Decoders at a time; others wait for their turn."""

_turns = threading.BoundedSemaphore(AT_ONCE)
_COMMAND: Final = (sys.executable, "-P", "-m", "lampyris.app.engine.decode")


# ---- the asking side --------------------


def decode(container: bytes) -> dict[str, Any]:
    """The map of some uploaded files.

    Returns
    -------
    ``ground`` (as :func:`lampyris.study.design.study_map.pack` makes it), ``start``, ``goal``, ``obstacle_cells`` (cells of the
    moving obstacles drawn in it), ``name``, ``format``, ``notes``.

    Raises
    ------
    LampyrisError : what is wrong with the files.
    LimitError : CPU_LIMIT, MEMORY, FILE_TOO_LARGE.
    InternalFault : DECODER: it ended unexpectedly.
    """
    if len(container) > MAX_BYTES:
        raise LimitError("FILE_TOO_LARGE", f"{len(container):,} bytes", allowed=f"at most {MAX_BYTES:,}")
    with _turns:
        return _asked(container)


def _asked(container: bytes) -> dict[str, Any]:
    # One thread of a library that would map memory for each core, and be short of it before it begins.
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    # The folder is made and removed here: a process that is ended cannot clean up.
    with tempfile.TemporaryDirectory(prefix="lampyris-map-", ignore_cleanup_errors=True) as folder:
        done = _run(container, folder, env)
    if ran_out_of_seconds(done.returncode):
        raise _too_long()
    if was_killed(done.returncode):
        raise _too_large()
    try:
        reply = json.loads(done.stdout[:MAX_ANSWER])
        error, found = reply.get("error"), reply.get("map")
    except (ValueError, AttributeError):
        error = found = None
    if isinstance(error, dict):
        raise _rebuilt(error)
    if not isinstance(found, dict):
        raise InternalFault("DECODER", f"the process that reads maps ended unexpectedly ({done.returncode})")
    return found


def _run(container: bytes, folder: str, env: dict[str, str]) -> subprocess.CompletedProcess[bytes]:
    try:
        return subprocess.run(
            (*_COMMAND, folder), input=container, capture_output=True, timeout=WALL, env=env, check=False
        )
    except subprocess.TimeoutExpired:
        raise _too_long() from None


def _too_long() -> LimitError:
    return LimitError("CPU_LIMIT", f"reading this takes more than {SECONDS} seconds", allowed="simpler files")


def _too_large() -> LimitError:
    return LimitError("MEMORY", "reading this takes too much memory", allowed=f"{MEMORY:,} bytes")


_KINDS: Final = {0: FileError, 1: LimitError, 2: InternalFault}


def _rebuilt(error: dict[str, Any]) -> LampyrisError:
    words = {key: str(error.get(key, ""))[:1000] for key in ("code", "what", "where", "allowed", "todo")}
    kind = _KINDS.get(error.get("kind", 0), FileError)
    fault = kind(
        words["code"], words["what"], where=words["where"], allowed=words["allowed"], todo=words["todo"]
    )
    for note in list(error.get("notes", ()))[:20]:
        fault.add_note(str(note)[:1000])
    return fault


# ---- the process itself --------------------


def main() -> None:
    """Read files from the standard input, and write what they are. ``sys.argv``: an empty private folder."""

    from lampyris._core.system import limit_memory, limit_seconds
    from lampyris.io.maps import load  # noqa: F401  before the memory is counted
    from lampyris.study.design import study_map  # noqa: F401

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    limit_seconds(SECONDS)
    limit_memory(MEMORY)
    folder = sys.argv[1]
    try:
        confine(folder)
        reply: dict[str, Any] = {"map": read_container(sys.stdin.buffer.read(MAX_BYTES + 1), Path(folder))}
    except MemoryError:
        reply = {"error": {**fault_of(_too_large()), "kind": 1}}
    except LampyrisError as fault:
        kind = next((k for k, v in _KINDS.items() if isinstance(fault, v)), 0)
        reply = {"error": {**_without(fault_of(fault), folder), "kind": kind}}
    except Exception as fault:
        what = f"{type(fault).__name__}: {fault}"[:300]
        reply = {"error": {**_without(fault_of(InternalFault("DECODER", what)), folder), "kind": 2}}
    sys.stdout.buffer.write(json.dumps(reply, separators=(",", ":")).encode())
    sys.stdout.buffer.flush()


def _without(error: dict[str, Any], folder: str) -> dict[str, Any]:
    """An error that does not tell where the private folder is."""
    return {
        key: value.replace(folder + os.sep, "").replace(folder, "") if isinstance(value, str) else value
        for key, value in error.items()
    }


def confine(folder: str) -> None:
    """From here on nothing is opened but in the folder, and code; nothing is started or connected to.

    A hook cannot be taken away again. It is no sandbox against machine code, but no reader of ours could
    open a file by a name that a map holds without passing it.
    """
    own = os.path.realpath(folder) + os.sep
    code = tuple(os.path.realpath(path) + os.sep for path in sys.path if path)
    writes = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_TRUNC

    def look(event: str, given: tuple[Any, ...]) -> None:
        if event == "open":
            name, _, flags = given
            if isinstance(name, int):
                return
            path = os.path.realpath(os.fsdecode(name))
            if path.startswith(own) or (path.startswith(code) and not (int(flags or 0) & writes)):
                return
            raise PermissionError(f"a file outside the private folder: {os.path.basename(path)!r}")
        if event.startswith(_NEVER):
            raise PermissionError(f"{event} is not for a reader of maps")

    sys.addaudithook(look)


_NEVER: Final = (
    "socket.", "subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "os.startfile",
    "ctypes.dlopen", "urllib.", "pickle.find_class", "shutil.", "ftplib.", "http.", "smtplib.",
)  # fmt: skip


def read_container(data: bytes, folder: Path) -> dict[str, Any]:
    """The map of the files of a container, written into a folder that is only theirs."""
    from lampyris.io.maps.load import load_map
    from lampyris.io.maps.map_hash import map_hash
    from lampyris.study.design import study_map

    files = files_of(data)
    main_ = _main_of([name for name, _ in files])
    called = {
        name: name if is_plain_name(name) else f"file{k}{Path(name).suffix.lower()}"
        for k, (name, _) in enumerate(files)
    }
    picture = ""
    for name, content in files:
        if name == main_:
            content, picture = beside(content, called)
        with open(folder / called[name], "xb") as out:
            out.write(content)
    try:
        found = load_map(folder / called[main_], strict=True, confined=True)
    except FileError as fault:
        if not picture or fault.code not in ("FILE_MISSING", "PATH_OUTSIDE"):
            raise
        todo = f"open {shown_name(main_)} and {shown_name(picture)} together"
        raise FileError(fault.code, fault.what, where=fault.where, todo=todo) from None
    return {
        "ground": {**study_map.pack(found.grid), "name": shown_name(main_)},
        "hash": map_hash(found.grid),
        "start": found.start,
        "goal": found.goal,
        "obstacle_cells": [list(cell) for cell in found.obstacle_cells],
        "name": shown_name(main_),
        "format": found.format,
        "notes": list(found.notes),
    }


_IMAGE: Final = re.compile(
    rb"""^(image[ \t]*+:[ \t]*+)(["']?)(?:([^"'\r\n#]{0,999})[\\/])?"""
    rb"""([^"'\r\n#\\/]{0,254}[^"'\r\n#\\/ \t])(["']?[ \t]*+(?:\#.*+)?\r?)$""",
    re.MULTILINE,
)
"""The line of a ROS map's YAML that names its picture: before, quote, folder, name, after.
Blanks are taken all or not at all: tried one by one, 2,000 of them took 22 s."""


def beside(text: bytes, there: Container[str]) -> tuple[bytes, str]:
    """A ROS map's YAML with its picture beside it, if that is among the files; and the picture's name.

    Old map savers write the whole path that the picture had on the robot. A browser gives files without
    folders, so nothing but the picture's own name can be meant.
    """
    found = _IMAGE.search(text) if text.count(b"\nimage") + text.startswith(b"image") == 1 else None
    if found is None:
        return text, ""
    name = found[4].decode("utf-8", "replace")
    if found[3] is None or name not in there:
        return text, name
    return text[: found.start()] + found[1] + found[2] + found[4] + found[5] + text[found.end() :], name


def files_of(data: bytes) -> list[tuple[str, bytes]]:
    """Names and contents of a container.

    Raises
    ------
    FileError : MAP_FILES: not such a container; FILE_NAME.
    """
    at, made = 4, []
    try:
        (count,) = struct.unpack_from("<I", data)
        if not 1 <= count <= MAX_FILES:
            raise FileError("MAP_FILES", f"{count:,} files", allowed=f"1 to {MAX_FILES}")
        for _ in range(count):
            (letters,) = struct.unpack_from("<H", data, at)
            name = _slice(data, at + 2, letters).decode("utf-8")
            at += 2 + letters
            (size,) = struct.unpack_from("<I", data, at)
            made.append((check_file_name(name), _slice(data, at + 4, size)))
            at += 4 + size
    except (struct.error, UnicodeDecodeError):
        raise FileError("MAP_FILES", "cut short, or not files as the page sends them") from None
    if at != len(data):
        raise FileError("MAP_FILES", f"{len(data) - at:,} bytes too many")
    folded = [name.casefold() for name, _ in made]
    if len(set(folded)) < len(folded):
        raise FileError("MAP_FILES", "two files of one name", allowed="each name once")
    return made


def _slice(data: bytes, at: int, size: int) -> bytes:
    if at + size > len(data):
        raise struct.error
    return data[at : at + size]


def _main_of(names: list[str]) -> str:
    """Which of some files is the map: the only one, or the YAML beside its picture."""
    yaml = [name for name in names if re.search(r"\.ya?ml$", name, re.IGNORECASE)]
    if len(names) == 1 or len(yaml) == 1:
        return (yaml or names)[0]
    raise FileError(
        "MAP_FILES",
        f"{len(names)} files, {len(yaml)} of them YAML",
        allowed="one map, or a ROS YAML and its picture",
    )


if __name__ == "__main__":
    main()
