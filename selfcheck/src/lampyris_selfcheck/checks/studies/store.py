"""Check: a damaged store is a typed error or is repaired exactly; never a silent loss."""

from __future__ import annotations

from collections.abc import Mapping

from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part
from lampyris_selfcheck.checks.studies import store_damage as damage
from lampyris_selfcheck.checks.studies import store_other as other


def _kinds(ask: Ask) -> Mapping[str, Kind]:
    return {**damage.kinds(), **other.kinds()}


def _run(ask: Ask, part: Part) -> Outcome:
    run = other.run if part.kind in other.kinds() else damage.run
    return run(ask, part).outcome()


CHECK = Check(
    "store",
    ("G17", "G19"),
    "a damaged store is a typed error or is repaired exactly, never a silent loss",
    _kinds,
    _run,
)
