"""Two writers, or a writer and a reader, of one store: one at a time, and no row lost or doubled."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np

from lampyris.errors import LampyrisError
from lampyris.study.design.row import Row
from lampyris.study.store.store import Store, open_for
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.studies.stores import BESIDE, clear, rows, study

PATIENCE = 120
"""Seconds that two processes may take for one small store."""


def writers(ask: Ask, kind: str, number: int, at: Path) -> tuple[list[str], str]:
    """Two writers and a reader in turn, as drawn: the second is refused, and no row is lost or doubled."""
    rng = ask.rng("store", kind, number)
    clear(at)
    hands: list[Store | None] = [None, None]
    try:
        return _in_turn(rng, at / "a", hands)
    finally:
        for hand in hands:
            if hand is not None:
                hand.close()


def _in_turn(rng: np.random.Generator, path: Path, hands: list[Store | None]) -> tuple[list[str], str]:
    of = study(5)
    given = rows(of)
    acknowledged: dict[str, Row] = {}
    seen: set[str] = set()
    for _ in range(int(rng.integers(8, 25))):
        who, what = int(rng.integers(2)), int(rng.integers(4))
        mine, theirs = hands[who], hands[1 - who]
        if mine is None:
            try:
                mine = hands[who] = open_for(path, of)
            except LampyrisError as error:
                seen.add("busy")
                if error.code != "STORE_BUSY" or theirs is None:
                    return sorted(seen), f"opening: {error}"
                continue
            if theirs is not None:
                return sorted(seen), "two were let in at once"
            if mine.rows() != acknowledged:
                return sorted(seen), f"{len(mine)} rows were found of {len(acknowledged)}"
        elif what == 0:
            mine.close()
            hands[who] = None
        elif what == 3:
            seen.add("read meanwhile")
            with Store.open(path, writable=False) as reader:
                if reader.rows() != acknowledged:
                    return sorted(seen), f"a reader saw other rows than the {len(acknowledged)}"
        else:
            some = [given[int(k)] for k in rng.integers(0, len(given), 5)]
            new = {row.key: row for row in some if row.key not in acknowledged}
            if mine.add(some) != len(new):
                return sorted(seen), "the number of new rows is not right"
            acknowledged |= new
    for who, hand in enumerate(hands):
        if hand is not None:
            hand.close()
            hands[who] = None
    if path.exists():
        with Store.open(path, writable=False) as reader:
            if reader.rows() != acknowledged:
                return sorted(seen), f"at the end {len(reader)} rows of {len(acknowledged)}"
    return sorted(seen), ""


_RACE = """
import random, sys, time
from lampyris.errors import LampyrisError
from lampyris_selfcheck.checks.studies.stores import rows, study
from lampyris.study.store.store import open_for
of, rng = study(15), random.Random(int(sys.argv[2]))
given, busy = rows(of), 0
rng.shuffle(given)
while given:
    try:
        with open_for(sys.argv[1], of) as store:
            for _ in range(rng.randrange(1, 5)):
                some, given = given[:3], given[3:]
                store.add(some)
    except LampyrisError as error:
        if error.code != "STORE_BUSY":
            raise SystemExit(str(error))
        busy += 1
    time.sleep(rng.random() * 0.004)
print(busy)
"""


def processes(ask: Ask, kind: str, number: int, at: Path) -> tuple[list[str], str]:
    """Two processes want the same store again and again: every row is in it once, and nothing lies beside."""
    rng = ask.rng("store", kind, number)
    clear(at)
    path, of = at / "a", study(15)
    seeds = [str(int(n)) for n in rng.integers(0, 2**31, 2)]
    them = [
        subprocess.Popen(
            [sys.executable, "-c", _RACE, str(path), seed], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        for seed in seeds
    ]
    try:
        said = [one.communicate(timeout=PATIENCE) for one in them]
    except subprocess.TimeoutExpired:
        return [], f"not done in {PATIENCE} s"
    finally:
        for one in them:
            one.kill()
            one.wait()
    for one, (_, errors) in zip(them, said, strict=True):
        if one.returncode:
            return [], f"ended with {one.returncode}: {errors.decode(errors='replace')[-300:]}"
    met = sum(int(out) for out, _ in said)
    with Store.open(path, writable=False) as store:
        if store.rows() != {row.key: row for row in rows(of)}:
            return [], f"{len(store)} rows of {len(of)}, or others"
    left = [e for e in BESIDE[1:] if path.with_name(path.name + e).exists()]
    return ["in each other's way"] if met else [], f"left beside it: {left}" if left else ""
