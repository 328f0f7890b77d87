"""The limits of what the app is told: one less and exactly as much are taken, one more is refused."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from lampyris.app.engine import comparison, decode, names, study_process
from lampyris.app.engine import parse as said
from lampyris.app.server import engines, library, request_parsing
from lampyris.app.server.guard import Refused
from lampyris.errors import LampyrisError
from lampyris.model.grid import Grid
from lampyris.study.design.study_map import pack
from lampyris_selfcheck.reference.files.map_files import png, rows

STATE: dict[str, Any] = {"version": 1, "map": "guide", "start": [0, 9], "goal": [7, 0]}
Ask = Callable[[int], object]


class Body:
    """A request with that body."""

    def __init__(self, raw: bytes) -> None:
        self._raw = raw
        self.headers = {"content-type": "application/json"}

    async def body(self) -> bytes:
        return self._raw


def json_of(raw: bytes) -> object:
    return asyncio.run(request_parsing.said(cast(Any, Body(raw)), None))


def study(**said_: Any) -> object:
    return study_process.study_of_question({"scenario": STATE, **said_})


def wide(n: int) -> object:
    """A scenario on a packed map of one row of n cells."""
    ends = {"map": "up-1", "start": [0, 0], "goal": [1, 0]}
    ground = pack(Grid(np.zeros((1, n), dtype=bool)))
    return said.scenario_of_request({"scenario": {**STATE, **ends}, "ground": ground})


def listed(n: int) -> object:
    return library._checked(
        {"name": "m", "ground": pack(Grid(np.zeros((n, 1), dtype=bool))), "start": None, "goal": None}
    )


def asked(n: int) -> object:
    """A question of n bytes; no engine is there to take it."""

    async def ask() -> None:
        nobody = engines.Engines(0)
        bare = len(json.dumps({"verb": "", "job": 1}, separators=(",", ":")))
        async for _ in nobody.ask({"verb": "x" * (n - bare)}):
            break

    return asyncio.run(asyncio.wait_for(ask(), 5))


LIMITS: dict[str, tuple[int, Ask, str]] = {
    "bytes of JSON": (request_parsing.MAX_JSON, lambda n: json_of(b"{}".ljust(n)), "JSON_SIZE"),
    "values of JSON": (
        request_parsing.MOST_VALUES,
        lambda n: json_of(b'{"a":[' + b"0," * (n - 2) + b"0]}"),
        "JSON_SIZE",
    ),
    "planners compared": (
        comparison.MOST_CONFIGS,
        lambda n: comparison._configs(
            [{"name": "x", "label": f"{k}"} for k in range(n)], "p", OWN, lambda *a: OWN
        ),
        "LIMIT",
    ),
    "seeds compared": (comparison.MOST_SEEDS, lambda n: comparison._seeds(n, 0), "SEEDS"),
    "seeds compared, listed": (
        comparison.MOST_SEEDS,
        lambda n: comparison._seeds(list(range(n)), 0),
        "SEEDS",
    ),
    "seeds of a study": (study_process.MOST_SEEDS, lambda n: study(seeds=n), "SEEDS"),
    "queries of a study": (study_process.MOST_QUERIES, lambda n: study(queries=n), "QUERIES"),
    "side of a map that is asked about": (said.MOST_SIDE, wide, "MAP_SIDE"),
    "side of a map that is shown": (said.MOST_SIDE, listed, "MAP_SIDE"),
    "name of a file": (names.MOST, lambda n: names.check_file_name("x" * n), "FILE_NAME"),
    "files of a map": (
        decode.MAX_FILES,
        lambda n: decode.files_of(library.container({f"{k}.pgm" if k else "m.yaml": b"x" for k in range(n)})),
        "MAP_FILES",
    ),
    "bytes of a question": (engines.MAX_QUESTION, asked, "QUESTION_SIZE"),
}
OWN = cast(Any, None)


def code_of(ask: Ask, n: int) -> str:
    """The code of the error, or nothing: within one limit another may be in the way."""
    try:
        ask(n)
    except LampyrisError as problem:
        return problem.code
    except Refused as problem:
        return str(problem.args[1])
    except (TimeoutError, engines.Busy):
        pass  # no engine
    return ""


@pytest.mark.commit(1)
@pytest.mark.parametrize("what", LIMITS)
def test_one_less_as_much_and_one_more(what: str) -> None:
    limit, ask, code = LIMITS[what]
    assert [code_of(ask, n) == code for n in (limit - 1, limit, limit + 1)] == [False, False, True]


def test_bytes_of_an_upload(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first look is at the size: nobody is started for one byte more."""
    read: list[int] = []
    monkeypatch.setattr(decode, "_asked", lambda data: read.append(len(data)))
    limit = decode.MAX_BYTES
    codes = [code_of(lambda n: decode.decode(bytes(n)), n) for n in (limit - 1, limit, limit + 1)]
    assert (codes, read) == (["", "", "FILE_TOO_LARGE"], [limit - 1, limit])


def test_runs_of_a_study(monkeypatch: pytest.MonkeyPatch) -> None:
    assert study_process.MOST_RUNS == 200_000
    monkeypatch.setattr(study_process, "MOST_RUNS", 8)
    assert [code_of(lambda n: study(seeds=n), n) for n in (7, 8, 9)] == ["", "", "STUDY_SIZE"]


def test_maps_of_a_folder_that_are_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library, "MOST_FILES", 3)
    small = png(1, 1, 8, 0, rows([255]))
    shown = library.Library(tmp_path, tmp_path / "spool")
    for n in range(1, 5):
        (tmp_path / f"m{n}.png").write_bytes(small)
        assert sum(row["kind"] == "folder" for row in shown.listing()) == min(n, 3)


@pytest.mark.parametrize("what", ["most_bytes", "most_files"])
def test_what_the_library_keeps(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = Grid([[False, True]])
    known = {"ground": pack(grid), "start": None, "goal": None, "notes": []}
    monkeypatch.setattr(library, "decode", lambda data: {**known, "name": data.decode()})

    def kept(folder: str, **most: int) -> list[str]:
        """What is said to each of five maps."""
        room = library.Library(None, tmp_path / folder, **most)
        return [code_of(lambda k: room.add(b"%d.png" % k), k) for k in range(5)]

    assert kept("bare") == [""] * 5
    sizes = {entry.stat().st_size for entry in (tmp_path / "bare").iterdir()}
    assert len(sizes) == 1
    unit = sizes.pop() if what == "most_bytes" else 1
    for most in (3 * unit - 1, 3 * unit, 3 * unit + 1):
        held = most // unit
        assert kept(f"{most}", **{what: most}) == [""] * held + ["LIBRARY_FULL"] * (5 - held)
