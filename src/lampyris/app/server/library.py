"""The library: the bundled maps, those of the user's folder, and those that were uploaded.

A map is asked for by its id. Ids are looked up in what there is; none is ever made part of a path. Files of
the folder and uploads are decoded in a process of their own (:mod:`lampyris.app.engine.decode`).
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import struct
import tempfile
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from lampyris._core import system
from lampyris.app.engine.decode import MAX_BYTES, decode
from lampyris.app.engine.frames import frame, json_frame
from lampyris.app.engine.names import is_plain_name
from lampyris.app.engine.parse import MOST_SIDE, unpacked
from lampyris.errors import FileError, LimitError
from lampyris.io.files import read_regular
from lampyris.io.maps import library as bundled
from lampyris.io.maps.formats.document import MapDocument, grid_codes
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.maps.thumbnail import thumbnail
from lampyris.model.traffic import MAX_OBSTACLES

MOST_BYTES: Final = 2**30
MOST_FILES: Final = 1000
ENDINGS: Final = (
    ".png", ".bmp", ".dib", ".pgm", ".pbm", ".ppm", ".pnm", ".npy", ".csv", ".map", ".txt", ".yaml", ".yml",
)  # fmt: skip
PICTURES: Final = ENDINGS[:7]
AWAY: Final = "gone-"
"""How the names of deleted maps begin. Links and drafts name maps; one click must not end them all."""
AWAY_SECONDS: Final = 86_400.0
KEPT: Final = 64
"""Decoded maps that are kept in memory, packed."""


def default_spool() -> Path:
    """Where uploads are kept if nobody says: they outlive the server, as do the drafts that name them.

    A user without a home folder (a container under a number that no user has) gets a folder of their own
    among the system's temporary files.
    """
    try:
        base = system.data_folder()
    except RuntimeError:
        return temporary_spool()
    return base / "lampyris" / "maps"


def temporary_spool() -> Path:
    """A folder for uploads where there is no home folder; it is this user's alone.

    Raises
    ------
    FileError : another program made a folder or a file of that name.
    """
    folder = Path(tempfile.gettempdir()) / f"lampyris-{system.user()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    info = folder.lstat()
    if not stat.S_ISDIR(info.st_mode) or not system.belongs_to_user(info):
        raise FileError("FILE_WRITE", "it is another user's", where=str(folder), todo="set XDG_DATA_HOME")
    return folder / "maps"


class Library:
    """Maps by id.

    Parameters
    ----------
    folder : the user's; None: there is none. Only its own regular files count, not those of folders in it,
        and no links.
    spool : where uploads are kept; None: see :func:`default_spool`. Made when it is needed.
    """

    def __init__(
        self,
        folder: Path | None = None,
        spool: Path | None = None,
        *,
        most_bytes: int = MOST_BYTES,
        most_files: int = MOST_FILES,
    ) -> None:
        self._folder, self._spool = folder, spool or default_spool()
        self._most_bytes, self._most_files = most_bytes, most_files
        self._lock = threading.Lock()
        self._decoded: OrderedDict[tuple[Any, ...], dict[str, Any]] = OrderedDict()

    # ---- what the server asks --------------------

    def listing(self) -> list[dict[str, Any]]:
        """Every map: ``id name kind width height free thumb``, what is not known yet null.

        ``kind``: ``bundled``, ``folder`` or ``upload``. A map of the folder is not read before a client looks
        at it; its thumbnail is such a look.
        """
        rows = [_bundled_row(name) for name in bundled.names()]
        for name, info in self._files().items():
            known = self._decoded.get(_mark(name, info))
            rows.append(_row(name, "folder", known, name))
        for name, info in self._uploads().items():
            with suppress(FileError, OSError, ValueError):
                known = self._upload(name, info)
                rows.append(_row(name.removesuffix(".json"), "upload", known, str(known["name"])))
        return rows

    def ground(self, id: str) -> bytes:
        """A map for the page: a frame ``H``, one ``B`` of cells (0 free, 1 wall, 2 unknown; row by row from
        the top), and with terrain one more.

        Raises
        ------
        FileError : MAP: there is no such map; or what is wrong with its file.
        """
        found, name, kind, notes = self._document(id)
        grid = found.grid
        head = {
            "id": id, "name": name, "kind": kind, "width": grid.width, "height": grid.height,
            "resolution": grid.resolution, "origin": list(grid.origin), "hash": map_hash(grid),
            "start": found.start, "goal": found.goal, "notes": list(notes),
            "obstacle_cells": [list(cell) for cell in found.obstacle_cells],
            "queries": [{"start": q.start, "goal": q.goal} for q in found.queries[:100]],
        }  # fmt: skip
        parts = [json_frame("H", head), frame("B", np.ascontiguousarray(grid_codes(grid)).tobytes())]
        if grid.terrain is not None:
            parts.append(frame("B", grid.terrain.tobytes()))
        return b"".join(parts)

    def thumb(self, id: str) -> bytes:
        """A small picture, PNG, encoded here whatever the map's file is.

        Raises
        ------
        FileError : as :meth:`ground`.
        """
        if id in bundled.names():
            return bundled.thumbnail_png(id)
        found, *_ = self._document(id)
        return thumbnail(found.grid, found.start, found.goal)

    def packed(self, id: str) -> dict[str, Any]:
        """A map for an engine; of a bundled one only the name, for engines have those themselves.

        Raises
        ------
        FileError : as :meth:`ground`.
        """
        if id in bundled.names():
            return {"bundled": id}
        known, _, _ = self._known(id)
        return {**known["ground"], "start": known["start"], "goal": known["goal"]}

    def add(self, files: bytes) -> dict[str, Any]:
        """Keep an uploaded map; the same map twice is one.

        Returns
        -------
        Its row of the listing, and ``notes`` of its reader.

        Raises
        ------
        LampyrisError : what is wrong with the files. LimitError : MAP_SIDE, LIBRARY_FULL.
        """
        known = _checked(decode(files))
        data = json.dumps(known, separators=(",", ":"), sort_keys=True).encode()
        id = f"up-{hashlib.sha256(data).hexdigest()[:24]}"
        with self._lock:
            self._keep(f"{id}.json", data)
        return {**_row(id, "upload", known, str(known["name"])), "notes": known["notes"]}

    def delete(self, id: str) -> None:
        """Put an uploaded map away; :meth:`bring_back` has it again for a day, or until room is needed.

        Raises
        ------
        FileError : MAP: there is no such map; MAP_FIXED: it was not uploaded.
        """
        name = f"{id}.json"
        with self._lock:
            there = self._uploads()
            if name in there:
                self._forget(time.time() - AWAY_SECONDS)
                os.replace(there[name].path, self._spool / f"{AWAY}{name}")
                os.utime(self._spool / f"{AWAY}{name}")
                return
        if id in bundled.names() or id in self._files():
            raise FileError("MAP_FIXED", "only uploaded maps can be deleted", where=id[:64])
        raise _missing(id)

    def bring_back(self, id: str) -> None:
        """Have a deleted map again.

        Raises
        ------
        FileError : MAP: there is none, or not any more. LimitError : LIBRARY_FULL.
        """
        name = f"{id}.json"
        with self._lock:
            away = self._away()
            if f"{AWAY}{name}" not in away:
                if name in self._uploads():
                    return
                raise _missing(id)
            entry = away[f"{AWAY}{name}"]
            if name in self._uploads():
                os.unlink(entry.path)
                return
            self._room(entry.stat(follow_symlinks=False).st_size, keep=entry.name)
            os.replace(entry.path, self._spool / name)

    # ---- where they are --------------------

    def _document(self, id: str) -> tuple[MapDocument, str, str, tuple[str, ...]]:
        if id in bundled.names():
            return bundled.load(id), id, "bundled", ()
        known, name, kind = self._known(id)
        packed = {**known["ground"], "start": known["start"], "goal": known["goal"]}
        found = replace(
            unpacked(packed), obstacle_cells=tuple((x, y) for x, y in known.get("obstacle_cells", ()))
        )
        return found, name, kind, tuple(known["notes"])

    def _known(self, id: str) -> tuple[dict[str, Any], str, str]:
        files = self._files()
        if id in files:
            info = files[id]
            return self._cached(_mark(id, info), lambda: self._read(id, files)), id, "folder"
        uploads = self._uploads()
        if f"{id}.json" in uploads:
            known = self._upload(f"{id}.json", uploads[f"{id}.json"])
            return known, str(known["name"]), "upload"
        raise _missing(id)

    def _files(self) -> dict[str, os.DirEntry[str]]:
        """Maps of the user's folder by name."""
        return (
            {}
            if self._folder is None
            else _regular(self._folder, lambda name: name.lower().endswith(ENDINGS))
        )

    def _uploads(self) -> dict[str, os.DirEntry[str]]:
        return _regular(self._spool, lambda name: name.startswith("up-") and name.endswith(".json"))

    def _read(self, name: str, files: Mapping[str, os.DirEntry[str]]) -> dict[str, Any]:
        """A file of the folder, decoded; a YAML with the pictures of the folder that it speaks of."""
        parts = {name: _content(files[name])}
        if name.lower().endswith((".yaml", ".yml")):
            text = parts[name]
            parts |= {
                other: _content(entry)
                for other, entry in files.items()
                if other.lower().endswith(PICTURES) and other.encode() in text
            }
        return _checked(decode(container(parts)))

    def _upload(self, name: str, info: os.DirEntry[str]) -> dict[str, Any]:
        return self._cached(_mark(name, info), lambda: _stored(_content(info)))

    def _cached(self, key: tuple[Any, ...], make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        with self._lock:
            if key in self._decoded:
                self._decoded.move_to_end(key)
                return self._decoded[key]
        made = make()
        with self._lock:
            self._decoded[key] = made
            while len(self._decoded) > KEPT:
                self._decoded.popitem(last=False)
        return made

    def _keep(self, name: str, data: bytes) -> None:
        """Store an upload, whole or not at all."""
        self._spool.mkdir(mode=0o700, parents=True, exist_ok=True)
        if name in self._uploads():
            return
        self._room(len(data))
        fresh = self._spool / f".{name}.{os.getpid()}"
        handle = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(handle, "wb") as out:
            out.write(data)
        os.replace(fresh, self._spool / name)

    def _room(self, size: int, keep: str = "") -> None:
        """Make room for so many bytes more: what was deleted goes permanently when there is none beside it."""
        there = self._uploads()
        held = sum(entry.stat(follow_symlinks=False).st_size for entry in there.values())
        if len(there) >= self._most_files or held + size > self._most_bytes:
            raise LimitError(
                "LIBRARY_FULL",
                f"{len(there):,} maps, {held:,} bytes",
                allowed=f"{self._most_files:,} maps, {self._most_bytes:,} bytes",
                todo="delete some uploaded maps",
            )
        away = self._away()
        held += sum(entry.stat(follow_symlinks=False).st_size for entry in away.values())
        if len(there) + len(away) >= self._most_files or held + size > self._most_bytes:
            self._forget(keep=keep)

    def _away(self) -> dict[str, os.DirEntry[str]]:
        """Deleted maps that can be had again."""
        return _regular(self._spool, lambda name: name.startswith(f"{AWAY}up-") and name.endswith(".json"))

    def _forget(self, before: float = float("inf"), keep: str = "") -> None:
        """Remove what was deleted before that time permanently."""
        for name, entry in self._away().items():
            if name != keep and entry.stat(follow_symlinks=False).st_mtime < before:
                os.unlink(entry.path)


def container(files: Mapping[str, bytes]) -> bytes:
    """Files as the page sends them: see :mod:`lampyris.app.engine.decode`."""
    parts = [struct.pack("<I", len(files))]
    for name, data in files.items():
        word = name.encode()
        parts += [struct.pack("<H", len(word)), word, struct.pack("<I", len(data)), data]
    return b"".join(parts)


def _regular(folder: Path, wanted: Callable[[str], bool]) -> dict[str, os.DirEntry[str]]:
    """Regular files of a folder, no links, by name in order."""
    found = {}
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                name = entry.name
                if is_plain_name(name) and wanted(name) and entry.is_file(follow_symlinks=False):
                    found[name] = entry
    except OSError:
        return {}
    return {name: found[name] for name in sorted(found)[:MOST_FILES]}


def _content(entry: os.DirEntry[str]) -> bytes:
    # By the entry's path: it was listed, and is looked at again, so that no link has come in its place.
    if not stat.S_ISREG(os.lstat(entry.path).st_mode):
        raise _missing(entry.name)
    return read_regular(entry.path, MAX_BYTES // 2)


def _mark(name: str, info: os.DirEntry[str]) -> tuple[Any, ...]:
    """A file as it is now; another content has another mark."""
    status = info.stat(follow_symlinks=False)
    return (name, status.st_ino, status.st_size, status.st_mtime_ns)


def _checked(known: dict[str, Any]) -> dict[str, Any]:
    """What the decoder says, looked at again; a map too large to be shown is refused."""
    found = unpacked({**known["ground"], "start": known["start"], "goal": known["goal"]})
    width, height = found.grid.width, found.grid.height
    if max(width, height) > MOST_SIDE:
        what = f"{width} x {height}"
        raise LimitError("MAP_SIDE", what, where=str(known["name"]), allowed=f"sides up to {MOST_SIDE:,}")
    obstacle_cells = known.get("obstacle_cells", [])
    if not isinstance(obstacle_cells, list) or len(obstacle_cells) > MAX_OBSTACLES:
        raise FileError("PACKED_MAP", "moving obstacles", allowed=f"at most {MAX_OBSTACLES:,} cells")
    for cell in obstacle_cells:
        whole = isinstance(cell, list) and len(cell) == 2 and all(type(c) is int for c in cell)
        if not (whole and found.grid.contains((cell[0], cell[1]))):
            raise FileError("PACKED_MAP", f"a moving obstacle at {cell!r:.40}", allowed="cells of the map")
    return {**known, "free": 1.0 - float(np.count_nonzero(found.grid.blocked)) / found.grid.blocked.size}


def _stored(data: bytes) -> dict[str, Any]:
    known = json.loads(data)
    if not isinstance(known, dict) or not {"ground", "start", "goal", "name", "notes", "free"} <= set(known):
        raise FileError("MAP", "not as it was stored")
    return known


def _row(id: str, kind: str, known: Mapping[str, Any] | None, name: str) -> dict[str, Any]:
    width, height, free = (
        (None, None, None)
        if known is None
        else (known["ground"]["width"], known["ground"]["height"], known["free"])
    )
    return {
        "id": id, "name": name, "kind": kind, "width": width, "height": height, "free": free,
        "thumb": f"/api/thumbs/{id}",
    }  # fmt: skip


def _bundled_row(name: str) -> dict[str, Any]:
    info = bundled.describe(name)
    return {
        "id": name, "name": name, "kind": "bundled", "width": info.width, "height": info.height,
        "free": info.free, "thumb": f"/api/thumbs/{name}", "title": info.title, "about": info.description,
        "gates": info.gates, "terrain": info.terrain is not None,
    }  # fmt: skip


def _missing(id: str) -> FileError:
    return FileError(
        "MAP", "there is no such map", where=ascii(id[:64])[1:-1], todo="look it up in the library"
    )
