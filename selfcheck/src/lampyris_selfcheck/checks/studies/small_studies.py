"""Small real studies of every kind, with every ending that hangs on no clock, and their exported bytes."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from lampyris.study.analysis.export import write_csv
from lampyris.study.analysis.table import table_of
from lampyris.study.design.row import Row
from lampyris.study.design.study import Study
from lampyris.study.design.study_file import load_study
from lampyris.study.execution.execution import Execution
from lampyris.study.execution.run import run
from lampyris.study.store.store import Store

_SHUT = "['..........', '.########.', '.#......#.', '.#.####.#.', '.#.#..#.#.', '.########.', '..........']"

PLAN = f"""
version: 1
name: plans
kind: plan
maps:
  - guide
  - {{bundled: maze-31, queries: {{random: 2}}}}
  - {{rows: {_SHUT}, name: shut, queries: [
       {{start: [0, 0], goal: [9, 6]}}, {{start: [0, 0], goal: [4, 4]}}]}}
planners:
  - astar
  - dstar-lpso
  - sipp
  - {{name: ad-gso, grid: {{choice: [greedy, roulette]}}}}
laws: [physical, three-speed]
traffic: [none, {{kind: random-walk, count: 3}}]
seeds: 2
budget: {{expansions: 600}}
"""

SIMULATE = """
version: 1
name: simulations
maps:
  - guide
  - {bundled: rooms-20, queries: {random: 1, least: 12}}
  - {rows: ['....#....', '....#....', '....#....'], name: cut, queries: [{start: [0, 0], goal: [8, 2]}]}
preset: dissertation
planners:
  - {name: ad-gso, grid: {choice: [greedy, roulette]}}
  - dstar-lpso
  - sipp
traffic:
  - {kind: random-walk, grid: {tracks: [live, replayed], count: [4, 77]}}
  - {kind: mixed, count: 3, tracks: live}
seeds: 3
"""

DRIVE = """
version: 1
name: drives
kind: drive
maps: [guide]
planners: [astar, {name: ad-gso, settings: {choice: roulette}}]
traffic: [none, {kind: random-walk, grid: {tracks: [live, replayed], count: [2]}}]
seeds: 1
"""

TEXTS = {"plan": PLAN, "simulate": SIMULATE, "drive": DRIVE}

_MINI = """
version: 1
name: mini
kind: {kind}
maps: [{{rows: ['......#...', '..#...#...', '..#.......', '......#...'], name: mini, queries: {{random: 1}}}}]
planners: [{{name: ad-gso, settings: {{choice: roulette}}}}, sipp]
traffic: [{{kind: random-walk, count: 1, tracks: {tracks}}}]
seeds: 1
seed: {seed}
"""


class Enough(Exception):
    """Raised by a sink that takes no more."""


def _loaded(text: str) -> Study:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.yaml"
        path.write_text(text, encoding="utf-8")
        return load_study(path)


def study(kind: str, seeds: int | None = None) -> Study:
    """One of them, with more seeds if so asked."""
    text = TEXTS[kind]
    if seeds is not None:
        text = "".join(
            f"seeds: {seeds}\n" if line.startswith("seeds:") else line for line in text.splitlines(True)
        )
    return _loaded(text)


def exported(made: Study, rows: Mapping[str, Row]) -> bytes:
    """The bytes of its CSV file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.csv"
        write_csv(path, table_of(made, rows))
        return path.read_bytes()


def small(kind: str, seed: int) -> Any:
    """What a study of two runs comes to: the bytes of its file, and its rows without times."""
    made = _loaded(
        _MINI.format(kind=kind, seed=seed, tracks="replayed" if seed % 2 or kind == "plan" else "live")
    )
    rows: list[Row] = []
    run(made, rows.extend)
    told = {row.key: row for row in rows}
    return exported(made, told), [(row.key, row.ending, row.metrics, row.error) for row in rows]


def at_once(made: Study) -> bytes:
    """The bytes of one sitting in this process, without a store."""
    rows: list[Row] = []
    run(made, rows.extend)
    return exported(made, {row.key: row for row in rows})


def through_store(made: Study, path: Path, where: Execution) -> bytes:
    """Runs what the store has not; the bytes of all that it has then."""
    with Store.open(path) if path.exists() else Store.create(path, made) as store:

        def sink(rows: Sequence[Row]) -> None:
            store.add(rows)

        run(made, sink, done=store.keys(), where=where)
        return exported(made, store.rows())


def in_sittings(made: Study, path: Path, sittings: int) -> bytes:
    """The same in so many sittings and a last one, each broken off after a part, each in another order."""
    for sitting in range(sittings):
        with Store.open(path) if sitting else Store.create(path, made) as store:
            stop = len(store) + len(made) // (sittings + 1)

            def sink(rows: Sequence[Row], store: Store = store, stop: int = stop) -> None:
                store.add(rows[: stop - len(store)])
                if len(store) == stop:
                    raise Enough

            with suppress(Enough):
                run(made, sink, done=store.keys(), where=Execution(shuffle=sitting))
    return through_store(made, path, Execution())
