"""Rows 92 to 97: budgets, studies of too many runs, and stores that are another's, damaged, or in the way."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

from bad_inputs.case import Case

STUDY = b"""version: 1
name: s
maps:
  - {bundled: guide, queries: [{start: [0, 9], goal: [7, 0]}]}
planners: [astar, dijkstra]
seeds: 2
"""
ENDS = "queries: [{start: [0, 9], goal: [7, 0]}]"
RUN = ("study", "s.yaml", "--workers", "1")
SHOW = ("study", "show", "s.study.db")
PDF = b"%PDF-1.7\n" * 99
HOLDER = """
import sys
from lampyris.study.store.store import Store
store = Store.open(sys.argv[1])
print("held", flush=True)
sys.stdin.read()
"""


def _edited(old: str, new: str) -> bytes:
    assert old in STUDY.decode()
    return STUDY.decode().replace(old, new).encode()


@cache
def store_of(study: bytes = STUDY) -> bytes:
    """The bytes of a store in which a study is done."""
    import tempfile

    import lampyris

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "s.yaml").write_bytes(study)
        lampyris.run_study(folder / "s.yaml", folder / "s.study.db")
        return (folder / "s.study.db").read_bytes()


def _broken(keep: float, flip: int | None = None) -> bytes:
    """A store cut after a share of its bytes, or with a bit of a byte of its runs turned over."""
    data = bytearray(store_of())
    if flip is not None:
        data[data.rindex(b'"outcome"') + flip] ^= 1
    return bytes(data[: int(len(data) * keep)])


def _folder_in_the_way(folder: Path) -> None:
    (folder / "s.study.db").mkdir()


def _read_only(folder: Path) -> None:
    """A folder that nothing can be written into, also by who may do anything."""
    (folder / "there").write_bytes(b"a file")


def _refused(row: int, name: str, study: bytes, code: str, *says: str, exit: int = 3) -> Case:
    return Case(row, name, RUN, {"s.yaml": study}, code, exit, ("s.yaml", *says))


CASES: list[Case] = [
    *(
        _refused(92, f"{said} seconds", STUDY + b"budget: {seconds: %s}\n" % word, "BUDGET", said, "0.001")
        for word, said in ((b"0", "0"), (b"-1", "-1"), (b".nan", "NaN"))
    ),
    _refused(92, "no expansions", STUDY + b"budget: {expansions: 0}\n", "BUDGET", "0", ">= 1"),
    _refused(
        93, "a thousand million runs", _edited("seeds: 2", "seeds: 500000000"), "LIMIT", "500,000,000",
        "1,000,000", exit=5,
    ),
    _refused(
        93, "forty million runs", _edited("seeds: 2", "seeds: 1000000").replace(
            b"planners: [astar, dijkstra]",
            b"planners: [{name: ad-gso, grid: {nt: [8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18]}}]",
        ), "LIMIT", "11,000,000 runs", "1,000,000 seeds x 11 planners", "10,000,000", exit=5,
    ),
    *(
        Case(
            94,
            name,
            (*RUN, *more),
            {"s.yaml": study, "s.study.db": store_of},
            "STORE_OTHER",
            3,
            ("s.study.db", *says),
        )
        for name, study, more, says in (
            ("other seeds", _edited("seeds: 2", "seeds: 3"), (), ("seeds",)),
            ("another planner", _edited("dijkstra", "ad-gso"), (), ("planners",)),
            ("other queries", _edited(ENDS, "limit: 2"), (), ("worlds",)),
            ("another goal", _edited("goal: [7, 0]", "goal: [1, 9]"), ("--dry-run",), ("worlds", "goal")),
        )
    ),
    *(
        Case(95, name, words, {"s.yaml": STUDY, "s.study.db": data}, code, 3, ("s.study.db", *says))
        for name, words, data, code, says in (
            ("cut in half", RUN, lambda: _broken(0.5), "STORE_DAMAGED", ("lampyris study repair",)),
            ("a byte turned", RUN, lambda: _broken(1, 12), "STORE_DAMAGED", ("lampyris study repair",)),
            ("cut, shown", SHOW, lambda: _broken(0.5), "STORE_DAMAGED", ("repair",)),
            ("a byte turned, exported", ("study", "export", "s.study.db", "--csv", "a.csv"),
             lambda: _broken(1, 12), "STORE_DAMAGED", ("repair",)),
            ("empty", RUN, b"", "STORE_DAMAGED", ("empty",)),
            ("not a store", RUN, PDF, "STORE_FORMAT", ("not a store",)),
            ("not a store, begun anew", (*RUN, "--fresh"), PDF, "STORE_FORMAT", ("not a store",)),
            ("nothing to repair", ("study", "repair", "s.study.db"), PDF, "STORE_FORMAT",
             ("not a store",)),
        )
    ),
    Case(95, "no store", SHOW, {}, "STORE_READ", 3, ("s.study.db", "no such file")),
    Case(
        97, "a folder in the way", RUN, {"s.yaml": STUDY}, "STORE_FORMAT", 3, ("s.study.db", "a folder"),
        setup=_folder_in_the_way,
    ),
    Case(
        97, "no such folder", (*RUN, "--store", "nowhere/s.db"), {"s.yaml": STUDY}, "STORE_WRITE", 3,
        ("nowhere",),
    ),
    Case(
        97, "in a file", (*RUN, "--store", "there/s.db"), {"s.yaml": STUDY}, "STORE_WRITE", 3, ("there",),
        setup=_read_only,
    ),
]  # fmt: skip


def hold(store: Path) -> subprocess.Popen[str]:
    """A process that has a store open for writing until its standard input is closed."""
    held = subprocess.Popen(
        [sys.executable, "-c", HOLDER, os.fspath(store)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert held.stdout is not None
    assert held.stdout.readline() == "held\n"
    return held
