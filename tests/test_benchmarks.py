"""The nouns of the benchmarks, their page, and the comparison of two records. Nothing is timed here."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
pytestmark = [
    pytest.mark.source,
    pytest.mark.skipif(not (ROOT / "benchmarks").is_dir(), reason="benchmarks are not shipped"),
]


@pytest.fixture(autouse=True)
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT))


def figure(ours: float, theirs: float | None = None, *, wide: float = 0.0, **more: Any) -> Any:
    from benchmarks.figures import Figure, Spread

    def around(middle: float) -> Spread:
        return Spread(middle, middle * (1 - wide), middle * (1 + wide), 5)

    told = {"task": "a map", "unit": "ns a cell", "rival": None if theirs is None else "them"} | more
    return Figure(ours=around(ours), theirs=None if theirs is None else around(theirs), **told)


def section(*figures: Any, **more: Any) -> Any:
    from benchmarks.figures import Section

    return Section(**{"name": "field", "title": "Fields", "how": "So.", "figures": figures} | more)


def test_a_spread_is_middle_and_quartiles() -> None:
    from benchmarks.figures import Spread

    assert Spread.of([4.0, 1.0, 2.0, 3.0, 5.0]) == Spread(3.0, 2.0, 4.0, 5)
    assert Spread.of([7.0]) == Spread(7.0, 7.0, 7.0, 1)
    # Of rates the quickest is the highest: low and high change places.
    assert Spread(2.0, 1.0, 4.0, 3).rate(8.0) == Spread(4.0, 2.0, 8.0, 3)


def test_a_ratio_says_how_many_times_as_good() -> None:
    assert figure(2.0, 50.0).ratio == 25.0
    assert figure(50.0, 2.0, unit="runs a second", more_is_better=True).ratio == 25.0
    assert figure(2.0).ratio is None
    assert figure(2.0, 50.0).holds is None
    assert figure(2.0, 50.0, asked=25).holds is True
    assert figure(2.0, 50.0, asked=26).holds is False


def test_verdicts_name_what_falls_short() -> None:
    from benchmarks.figures import judge, judge_cost

    several = [figure(1.0, 30.0, asked=25, task="open"), figure(1.0, 20.0, asked=25, task="maze")]
    told = judge("beside them", several)
    assert not told.holds
    assert "maze (20.00)" in told.text
    assert "open (" not in told.text
    assert judge("beside them", several[:1]).holds
    costs = [figure(2.9, 1.0, asked=1 / 3, task="flat"), figure(3.1, 1.0, asked=1 / 3, task="noise")]
    told = judge_cost("weighted", costs)
    assert not told.holds
    assert "noise (3.10)" in told.text
    assert "flat (" not in told.text
    assert judge_cost("weighted", costs[:1]).holds


def test_a_record_comes_back_as_it_was() -> None:
    from benchmarks.figures import figures_of

    kept = section(figure(2.0, 50.0, asked=25, note="cuts corners"), figure(3.0, task="alone"))
    record = json.loads(json.dumps(kept.record()))
    assert tuple(figures_of(record)) == kept.figures
    assert [f["ratio"] for f in record["figures"]] == [25.0, None]
    assert [f["key"] for f in record["figures"]] == ["a map | them", "alone"]


def test_the_page_tells_claims_tables_and_figures() -> None:
    from benchmarks.figures import Table, Verdict
    from benchmarks.page import page

    claims = (Verdict(True, "quick"), Verdict(False, "small"))
    table = Table(("a|b", "c"), (("1", "x | y"),), "Rows")
    one = section(figure(1.0, 9.0), verdicts=claims, tables=(table,), about={"python": "3"})
    two = section(figure(2.0, 50.0, asked=30), name="query", title="Queries, all of them")
    text = page([json.loads(json.dumps(s.record())) for s in (one, two)])
    assert "- [Fields](#fields): 1 hold, **1 short**" in text
    assert "(#queries-all-of-them)" in text
    assert "- holds: quick" in text
    assert "- **SHORT**: small" in text
    assert "| 1 | x \\| y |" in text
    assert "Measured with python 3." in text
    # A section with tables of its own gets no other; one without shows its figures.
    assert "9 x" not in text
    assert "| 25 x (asked: 30) |" in text


def test_comparing_finds_what_got_worse_and_only_that() -> None:
    from benchmarks.compare import shifts

    old = [section(figure(1.0, 20.0, wide=0.02)).record()]
    slower = [section(figure(2.0, 20.0, wide=0.02)).record()]
    found, alone = shifts(old, slower)
    assert [(s.before, s.after, s.factor, s.apart) for s in found] == [(20.0, 10.0, 0.5, True)]
    assert not alone
    # A machine half as fast is slower for all: no ratio moves.
    found, _ = shifts(old, [section(figure(2.0, 40.0, wide=0.02)).record()])
    assert [(s.factor, s.apart) for s in found] == [(1.0, False)]
    # Quartiles that meet are noise.
    found, _ = shifts(
        [section(figure(1.0, 20.0, wide=0.5)).record()], [section(figure(2.0, 20.0, wide=0.5)).record()]
    )
    assert [s.apart for s in found] == [False]


def test_what_has_no_rival_is_compared_unless_it_is_a_time() -> None:
    from benchmarks.compare import shifts

    def both(unit: str, before: float, after: float, **more: Any) -> list[float]:
        found, _ = shifts(
            [section(figure(before, unit=unit, **more)).record()],
            [section(figure(after, unit=unit, **more)).record()],
        )
        return [s.factor for s in found]

    assert both("bytes a cell", 10.0, 20.0) == [0.5]
    assert both("cells expanded", 20.0, 10.0) == [2.0]
    assert both("cells told apart", 10.0, 20.0, more_is_better=True) == [2.0]
    assert both("ms", 10.0, 20.0) == []
    assert both("ns a cell", 10.0, 20.0) == []


def test_what_one_record_lacks_is_named() -> None:
    from benchmarks.compare import shifts

    old = [section(figure(1.0, 20.0), figure(1.0, 5.0, task="gone")).record()]
    new = [section(figure(1.0, 20.0), figure(1.0, 5.0, task="new")).record(), section(name="start").record()]
    found, alone = shifts(old, new)
    assert [s.key for s in found] == ["field: a map | them"]
    assert alone == ["field: gone | them", "field: new | them"]
    # An older record may not know a key that figures have by now, nor we one that it has.
    for row in old[0]["figures"]:
        del row["note"], row["more_is_better"]
        row["told by"] = "an older or a newer version"
    assert shifts(old, new) == (found, alone)


def test_compare_tells_by_its_exit_code_when_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from benchmarks import compare

    old, new = tmp_path / "old.json", tmp_path / "new.json"
    old.write_text(json.dumps({"sections": [section(figure(1.0, 20.0)).record()]}))
    new.write_text(json.dumps({"sections": [section(figure(2.0, 20.0)).record()]}))
    for more, code in (([], 0), (["--strict"], 1), (["--strict", "--worse", "3"], 0)):
        monkeypatch.setattr(sys, "argv", ["compare", str(old), str(new), *more])
        assert compare.main() == code
    told = capsys.readouterr().out
    assert "WORSE   field: a map | them: 20 -> 10 (0.50 times)" in told
    assert "1 figures in both: 0 worse, 0 better, 1 within 3 times" in told


def test_every_section_has_a_module() -> None:
    from benchmarks.__main__ import NAMES

    here = {p.stem.removeprefix("bench_") for p in (ROOT / "benchmarks").glob("bench_*.py")}
    assert here - set(NAMES) == {"app"}
    for name in here & set(NAMES):
        text = (ROOT / "benchmarks" / f"bench_{name}.py").read_text(encoding="utf-8")
        assert "\nTITLE = " in text
        assert "\ndef bench(quick: bool) -> Section:" in text
        assert "argparse" not in text


def test_nouns_are_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        figure(1.0).task = "another"
