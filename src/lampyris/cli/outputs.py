"""Files that a verb writes: allowed names, checks before any work is done, and the report of what was written."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lampyris.cli import text
from lampyris.cli.option_errors import check_choice
from lampyris.errors import FileError, UsageError

if TYPE_CHECKING:
    from lampyris.app.replay.page import RunPage

STDOUT = Path("-")
"""In place of a file: standard output, for tables of text."""
PICTURES = (".png", ".svg")
ENDINGS: Mapping[str, tuple[str, ...]] = {
    "picture": PICTURES,
    "chart": PICTURES,
    "film": (".webp", ".gif"),
    "csv": (".csv", ".txt", ""),
    "latex": (".tex", ".txt", ""),
    "parquet": (".parquet",),
    "report": (".html", ".htm"),
    "replay": (".html", ".htm"),
    "export": (".json", ".yaml", ".yml"),
    "bag": (".mcap", ".db3", ""),
    "scenario": (".yaml", ".yml", ".json"),
    "primitives": (".json", ".mprim"),
    "study": (".yaml", ".yml"),
    "record": (".jsonl", ".ndjson", ".json", ".txt", ""),
    "ledger": (".ledger", ".jsonl", ".ndjson", ".json", ".txt", ""),
}
"""How a file of each kind may end; an empty one: a name without an ending will do."""
TO_STDOUT = ("csv", "latex")
"""Kinds that ``-`` writes to standard output."""
LAYERS = ("luciferin", "cost", "none")
"""What a picture of a plan may show under the path; the first is the default."""


def check_outputs(force: bool, *paths: Path | None, json: bool = False, **kinds: Path | None) -> None:
    """Reject before any work what could not be written at the end.

    Parameters
    ----------
    force : whether files that exist are overwritten.
    paths : files whose endings are checked elsewhere.
    json : whether JSON goes to standard output.
    kinds : files by the kind of :data:`ENDINGS`.

    Raises
    ------
    UsageError : SUFFIX; EXISTS; OPTIONS: two outputs to one place.
    FileError : FILE_WRITE: the place cannot be written to.
    """
    to_stdout = [f"--{kind} -" for kind, path in kinds.items() if path == STDOUT and kind in TO_STDOUT]
    to_stdout += ["--json"] if json else []
    if len(to_stdout) > 1:
        what = f"{to_stdout[0]} and {to_stdout[1]} both write to standard output"
        raise UsageError("OPTIONS", what, allowed="one of them")
    named = {
        kind: path
        for kind, path in kinds.items()
        if path is not None and not (path == STDOUT and kind in TO_STDOUT)
    }
    files = [path for path in (*paths, *named.values()) if path is not None]
    given = [os.path.realpath(path) for path in files]
    twice = next((path for path, real in zip(files, given, strict=True) if given.count(real) > 1), None)
    if twice is not None:
        raise UsageError("OPTIONS", f"two outputs to {twice}", allowed="a file of its own for each")
    for kind, path in named.items():
        check_ending(kind, path)
    for path in files:
        if demand_place(path) and not force:
            raise UsageError(
                "EXISTS", "the file exists", where=str(path), todo="give --force to overwrite it"
            )


def check_ending(kind: str, path: Path) -> None:
    """Refuse a name whose ending promises another format.

    Raises
    ------
    UsageError : SUFFIX.
    """
    endings = ENDINGS[kind]
    if "" in endings and not path.suffix:
        return
    from lampyris.report.style import suffix_of

    suffix_of(path, tuple(ending for ending in endings if ending))


def demand_place(path: Path, *, append: bool = False) -> bool:
    """See that a file can be written there; whether there is one that would be lost.

    Folders, pipes, sockets and disks are refused: opening a pipe without a reader would wait forever.
    ``/dev/null`` and other devices of characters may be written to, but not read back (``append``).

    Raises
    ------
    FileError : FILE_WRITE.
    """
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        mode = None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        allowed = "a file in a folder you may write in"
        raise FileError("FILE_WRITE", why, where=str(path), allowed=allowed) from None
    if mode is not None and not stat.S_ISREG(mode) and (append or not stat.S_ISCHR(mode)):
        kinds = ((stat.S_ISDIR, "folder"), (stat.S_ISFIFO, "pipe"), (stat.S_ISSOCK, "socket"))
        kind = next((word for is_kind, word in kinds if is_kind(mode)), "device")
        raise FileError("FILE_WRITE", f"it is a {kind}", where=str(path), allowed="a regular file")
    folder = Path(os.path.realpath(path)).parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise FileError(
            "FILE_WRITE", "cannot write there", where=str(path), allowed="a folder you may write in"
        )
    return mode is not None and stat.S_ISREG(mode)


@contextmanager
def place(path: Path) -> Iterator[Path]:
    """Where to write a file of text; what was written for ``-`` goes to standard output when all is there."""
    if path != STDOUT:
        yield path
        return
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="lampyris-") as folder:
        file = Path(folder) / "out"
        yield file
        with file.open(encoding="utf-8", newline="") as written:
            while part := written.read(2**16):
                sys.stdout.write(part)
    sys.stdout.flush()


def text_beside(*paths: Path | None) -> AbstractContextManager[object]:
    """Text for people goes to standard error while one of these files is standard output."""
    return redirect_stdout(sys.stderr) if STDOUT in paths else nullcontext()


def print_written(*paths: Path | None) -> None:
    """Print which files were written."""
    for path in paths:
        if path is not None and path != STDOUT and path.exists():
            text.line(f"wrote {path}")


def write_replay(path: Path, replay: RunPage, *, json: bool) -> None:
    """Write a replay, and print the digest that it shows: beside JSON to standard error, else where results go."""
    from lampyris.app.replay.page import replay_page
    from lampyris.io.atomic_write import whole_file

    page = replay_page(replay).encode()
    with whole_file(path) as file:
        file.write(page)
    if json:
        text.print_notes((f"digest of the replay: {replay.digest}",))
    else:
        print_written(path)
        text.line(f"digest {replay.digest}")


@dataclass(frozen=True)
class Outputs:
    """What ``plan``, ``simulate``, ``run`` and ``drive`` print and write."""

    json: bool = False
    timing: bool = True
    csv: Path | None = None
    save: Path | None = None
    force: bool = False
    explain: bool = False
    picture: Path | None = None
    layer: str | None = None
    film: Path | None = None
    chart: Path | None = None
    export: Path | None = None
    bag: Path | None = None
    replay: Path | None = None

    def check(self) -> None:
        """Reject before any work what could not be written at the end."""
        check_outputs(
            self.force, self.save, json=self.json, picture=self.picture, film=self.film, chart=self.chart,
            csv=self.csv, export=self.export, bag=self.bag, replay=self.replay,
        )  # fmt: skip
        if self.bag is not None:
            from lampyris.ros.stores import typestore

            typestore()  # rosbags is there, or the call ends now
        check_choice("LAYER", "--layer", self.layer or LAYERS[0], LAYERS)
        if self.save is not None:
            from lampyris.io.scenario.save import check_ending

            check_ending(self.save)

    def write_ros(self, what: Any, scene: Any = None, profile: Any = None) -> None:
        """Write the path and the bag that were asked for; a plan or a run that has none gives a note."""
        from lampyris.cli.text import print_notes

        for kind, path in (("export", self.export), ("bag", self.bag)):
            if path is None:
                continue
            from lampyris import ros

            try:
                if kind == "export":
                    ros.export_path(what, path, profile)
                else:
                    ros.write_bag(what, path, scene=scene, profile=profile)
            except UsageError as none:
                if none.code not in ("EXPORT", "BAG"):
                    raise
                print_notes((f"no path, so no {kind} was written",))

    def without_timing(self, record: dict[str, Any]) -> dict[str, Any]:
        """The record, with ``timing`` emptied if timings are not wanted: then the same call gives the same bytes."""
        return record if self.timing else {**record, "timing": {}}
