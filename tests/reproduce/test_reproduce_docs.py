"""The page about it says what is so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lampyris.reproduce.tables import printed, printed_data
from lampyris.reproduce.tables.verdict import count

PAGE = Path(__file__).parents[2] / "docs" / "reproduce.md"


@pytest.mark.source
def test_its_counts_are_those_of_the_verdicts() -> None:
    words = PAGE.read_text(encoding="utf-8")
    found = count(v for table in printed_data.tables() for v in printed.verdicts(table))
    for kind, many in found.items():
        assert re.search(rf"^\| {kind} \|.*\| {many} \|$", words, re.MULTILINE), kind
    assert f"{sum(found.values()):,} figures" in words


@pytest.mark.source
def test_its_python_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    exec(compile(block, str(PAGE), "exec"), {})
    assert "'65.64'" in capsys.readouterr().out


@pytest.mark.source
def test_its_numbers_of_table_4_2_are_those_of_the_verdicts() -> None:
    spelled = {1: "one", 2: "two", 7: "seven", 9: "nine", 10: "ten", 11: "Eleven"}
    verdicts = list(printed.verdicts("4.2"))
    transposed = [v for v in verdicts if "printed as (row, column)" in v.why]
    walls = [v for v in verdicts if v.verdict == "impossible"]
    digits = [v for v in verdicts if v.verdict == "misprint" and v not in transposed]
    words = PAGE.read_text(encoding="utf-8")
    assert (
        f"Table 4.2 but for {spelled[len(digits)]} digit, {spelled[len(transposed)]} transposed pointers and "
        f"{spelled[len(walls)]} that point at walls"
    ) in words
    of_free_cells = [v for v in transposed if "touch the cell" in v.why]
    method = (PAGE.parent / "method.md").read_text(encoding="utf-8")
    assert f"{spelled[len(of_free_cells)]} of them are printed there as (row, column)" in method
    for v in transposed:  # What the program itself says of their number.
        assert f"as {spelled[len(transposed)]} in rows 0 and 1 are" in v.why
    eleven = [v for v in printed.verdicts("4.11") if v.verdict == "impossible"]
    two = [v for v in printed.verdicts("4.10") if v.verdict == "impossible"]
    counts = f"{spelled[len(eleven)]} cells of Table 4.11 and {spelled[len(two)]} of 4.10 are impossible"
    assert counts in " ".join(words.split())
