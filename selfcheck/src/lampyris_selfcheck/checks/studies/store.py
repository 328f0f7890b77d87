"""Check: a damaged store is a typed error and can be repaired; what is no store, or another's, is refused."""

from __future__ import annotations

from collections.abc import Mapping

from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.studies import store_damage, store_foreign, store_writers
from lampyris_selfcheck.scratch import folder


def _kinds(ask: Ask) -> Mapping[str, Kind]:
    bits, pages = store_damage.bits(), store_damage.pages()
    none, others = store_foreign.foreign_cases(), store_foreign.other_studies()
    return {
        "bit": Kind(
            "every bit of one run's record: that run is named and lost, repair keeps all others",
            100, bits, bits, 100, bits,
        ),
        "page": Kind("every page of zeros, of ones, of another page, or with one record fewer", 48, pages, pages, 48, pages),
        "cut": Kind("a store cut at a drawn size, or its log", 40, 2000, 20_000, 50),
        "noise": Kind("one to three bits anywhere, of the main file or the log", 150, 10_000, 100_000, 100),
        "foreign": Kind(
            "what is no store, or not all of one: the right error, nothing changed, and repair saves all",
            none, none, none, none, none,
        ),
        "resume": Kind(
            "resuming in the store of another study is refused, with the field that differs",
            others, others, others, others, others,
        ),
        "writers": Kind(
            "two writers and a reader in turn: one at a time, no row lost or doubled", 40, 6000, 50_000, 50
        ),
        "processes": Kind("two processes that want one store at once", 2, 60, 300, 2),
    }  # fmt: skip


_CASES = {
    "foreign": store_foreign.foreign,
    "resume": store_foreign.resume,
    "writers": store_writers.writers,
    "processes": store_writers.processes,
}


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    case = _CASES.get(part.kind, store_damage.damage)
    with folder() as at:
        for number in part.numbers:
            try:
                seen, wrong = case(ask, part.kind, number, at)
            except Exception as fault:
                seen, wrong = [], f"{type(fault).__name__}: {fault!s:.300}"
            tally.case(*seen)
            if wrong:
                tally.fail(number, wrong)
    return tally.outcome()


CHECK = Check(
    "store",
    ("G17", "G19"),
    "a damaged store is a typed error and can be repaired; what is no store, or another's, is refused",
    _kinds,
    _run,
)
