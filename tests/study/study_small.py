"""Small real studies of every kind, and their exported bytes."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

from lampyris.study.design import Study
from lampyris.study.export import write_csv
from lampyris.study.file import load_study
from lampyris.study.row import Row
from lampyris.study.table import table_of

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


def study(kind: str, seeds: int | None = None) -> Study:
    """One of them, with more seeds if so asked."""
    text = TEXTS[kind]
    if seeds is not None:
        text = "".join(
            f"seeds: {seeds}\n" if line.startswith("seeds:") else line for line in text.splitlines(True)
        )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.yaml"
        path.write_text(text)
        return load_study(path)


def exported(made: Study, rows: Mapping[str, Row]) -> bytes:
    """The bytes of its CSV file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.csv"
        write_csv(path, table_of(made, rows))
        return path.read_bytes()
