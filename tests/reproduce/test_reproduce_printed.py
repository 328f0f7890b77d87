"""Every printed figure has a verdict, the data are whole, and what came out exactly still does."""

from __future__ import annotations

import math

import pytest

from lampyris.errors import InternalFault
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.reproduce.tables import printed, printed_data, velocity, walk
from lampyris.reproduce.tables.verdict import KINDS, Verdict, count, same

# table: (exact, rounded, given, misprint, not reproducible, impossible)
FOUND = {
    "3.1": (2, 0, 6, 0, 0, 0),
    "4.1": (0, 0, 4, 0, 0, 0),
    "4.2": (165, 0, 22, 10, 0, 2),
    "4.3": (108, 0, 0, 1, 13, 8),
    "4.4": (29, 0, 0, 0, 0, 0),
    "4.5": (18, 0, 0, 9, 0, 0),
    "4.6": (17, 0, 0, 12, 0, 2),
    "4.7": (0, 0, 4, 0, 0, 0),
    "4.8": (0, 0, 70, 0, 100, 0),
    "4.9": (8, 0, 5, 2, 0, 0),
    "4.10": (0, 0, 2, 1, 7, 2),
    "4.11": (0, 0, 180, 1, 348, 11),
    "4.12": (57, 0, 13, 3, 33, 1),
    "4.13": (56, 0, 13, 4, 22, 0),
    "4.14": (63, 0, 14, 2, 24, 0),
    "4.15": (89, 0, 19, 1, 34, 0),
    "4.16": (98, 0, 24, 13, 43, 5),
    "4.17": (118, 0, 24, 3, 46, 0),
    "4.18": (1, 1, 6, 8, 0, 0),
    "text": (39, 2, 1, 36, 8, 2),
}


def by_where(table: str) -> dict[str, Verdict]:
    return {v.where: v for v in printed.verdicts(table)}


def test_the_tables_are_those_of_the_dissertation() -> None:
    wanted = ["3.1", *(f"4.{k}" for k in range(1, 19)), "text"]
    assert list(printed_data.tables()) == list(printed.CHECKS) == list(FOUND) == wanted


@pytest.mark.parametrize("table", FOUND)
def test_every_figure_has_one_verdict_and_a_reason(table: str) -> None:
    verdicts = printed.verdicts(table)
    figures = list(printed_data.figures(table))
    assert [(v.where, v.printed) for v in verdicts] == [(f.where, f.printed) for f in figures]
    assert len({v.where for v in verdicts}) == len(verdicts)
    assert tuple(count(verdicts).values()) == FOUND[table]
    for v in verdicts:
        assert v.table == table
        assert v.verdict in KINDS
        assert v.why
        assert v.ours or v.verdict in ("given", "not reproducible"), v


@pytest.mark.parametrize("table", FOUND)
def test_no_cell_of_the_data_is_lost(table: str) -> None:
    info = printed_data.about(table)
    assert len(printed_data.rows(table)) == info["rows"]
    assert len(list(printed_data.figures(table))) == info["printed"] == sum(FOUND[table])


def test_all_figures_together() -> None:
    assert sum(sum(counts) for counts in FOUND.values()) == 2095


def test_a_figure_without_a_verdict_is_refused() -> None:
    verdicts = printed.verdicts("4.9")
    with pytest.raises(InternalFault, match="VERDICT_MISSING"):
        printed.whole("4.9", verdicts[:-1])
    with pytest.raises(InternalFault, match="VERDICT_MISSING"):
        printed.whole("4.9", (*verdicts, verdicts[0]))
    with pytest.raises(ValueError, match="reason"):
        Verdict("4.9", "nt 8: iterations", "19.5", "19.5", "exact", "")
    with pytest.raises(ValueError, match="not a verdict"):
        Verdict("4.9", "nt 8: iterations", "19.5", "19.5", "right", "so")


def test_exact_figures_are_ours_to_the_printed_digit() -> None:
    """Whatever says exact is held again against the number beside it."""
    checked = 0
    for table in FOUND:
        for v in printed.verdicts(table):
            if v.verdict == "exact" and not v.printed.startswith("("):
                number = v.ours.replace("blocked", "10000").replace("outside", "10000")
                assert same(v.printed, float(number.split(" ")[0])), v
                checked += 1
            elif v.verdict == "exact":
                assert v.printed in v.ours.split(" or "), v
    assert checked > 500


def test_misprints_differ_from_what_they_should_be() -> None:
    for table in FOUND:
        for v in printed.verdicts(table):
            if v.verdict == "misprint":
                assert v.ours not in ("", v.printed), v


@pytest.mark.parametrize(
    ("text", "ours", "expected"),
    [
        ("6.854", 6.854976, True),
        ("6.855", 6.854976, True),
        ("6.853", 6.854976, False),
        ("4.28", 4.2816, True),
        ("2.97", 2.976, True),
        ("2.98", 2.976, True),
        ("0.0360", 0.0361, False),
        ("20", 20.0, True),
        ("13.66", 13.660525, True),
        ("64.1", 64.1, True),
        ("65.4", 65.64, False),
        ("0.0", 0.04, True),
    ],
)
def test_same_at_the_printed_digits(text: str, ours: float, expected: bool) -> None:
    assert same(text, ours) is expected


def test_probabilities_of_two_tables_have_the_denominators_that_are_said() -> None:
    """Tables 4.5 and 4.6: each share is its difference in luciferin over 46.864 and over 9.00."""
    luciferin = {printed_data.cell(r["cell"]): float(r["luciferin"]) for r in printed_data.rows("4.2")}
    luciferin[8, 1] = 0.84  # as Table 4.6 has it
    for table, robot, sum_of_differences in (("4.5", (5, 4), 46.864), ("4.6", (7, 2), 9.0)):
        for cell, chance in printed_data.accepted(table).items():
            share = (luciferin[robot] - luciferin[cell]) / sum_of_differences
            assert abs(chance - share) < 0.001, (table, cell)
    shares = {t: round(math.fsum(printed_data.accepted(t).values()), 2) for t in ("4.3", "4.4", "4.5", "4.6")}
    assert shares == {"4.3": 1.0, "4.4": 1.0, "4.5": 0.3, "4.6": 0.65}


def test_the_column_beside_table_4_3_is_a_field_of_another_map() -> None:
    """Its values follow from each other by the recursion, so they are no noise."""
    for parent, cost, cell in ((13.959, 12.2, 15.695), (15.695, 13.6, 17.577), (16.465, 14.0, 18.279)):
        assert 0.6 * parent + 0.6 * cost == pytest.approx(cell, abs=0.001)


def test_the_corrections_bring_the_printed_means_out() -> None:
    assert same("65.36", velocity.means("4.16")[1])
    assert same("74.08", velocity.means("4.17")[1])
    assert not same("65.36", velocity.means("4.16")[0])
    assert not same("74.08", velocity.means("4.17")[0])
    assert velocity.rule("4.17")[1:4] == (28.0, 48.0, 68.0)


def test_without_its_corrections_table_4_17_does_not_come_out(monkeypatch: pytest.MonkeyPatch) -> None:
    cached = (velocity.corrected, velocity.cells, velocity.rule, velocity.angles, velocity.means)
    for f in cached:
        f.cache_clear()
    monkeypatch.setattr(velocity, "CORRECTED", {})
    try:
        assert velocity.rule("4.17")[1] == 20.0
        assert velocity.angles("4.17")[2] == "135"
        assert velocity.means("4.17")[1] == pytest.approx(73.739, abs=0.001)
    finally:
        for f in cached:
            f.cache_clear()


def test_known_verdicts() -> None:
    field = by_where("4.2")
    assert (field["(0,5): luciferin"].verdict, field["(5,0): back pointer"].ours) == ("misprint", "(6,0)")
    assert field["(3,3): back pointer"].verdict == "impossible"
    assert by_where("4.3")["accepted, 2, probability"].ours == "0.0569"
    eleven = by_where("4.11")
    low = eleven["environment 2, (34,38), to (25,13), ad-gso: path cost"]
    assert (low.verdict, low.ours) == ("impossible", "at least 28.6")
    assert eleven["environment 4, (27,1), to (16,48), ad-gso: path cost"].verdict == "impossible"
    assert eleven["environment 5, (26,4), to (23,48), mixed: path cost"].verdict == "impossible"
    text = by_where("text")
    assert text["path cost of the guide example, 4.2, 4.3"].ours == "12.4"
    assert text["path cost when an obstacle stands on (7,1), 4.3"].ours == "13.2"
    assert text["mean path cost, AD-GSO, abstract, 4.4, 5.2"].ours == "65.22"
    assert text["fewer iterations than mixed, per cent, 4.4"].ours == "77.1089"


def test_what_belongs_to_a_lost_map_is_no_misprint() -> None:
    """The column of luciferin beside Table 4.3: whatever differs there is told with ours and with why."""
    beside = [v for v in printed.verdicts("4.3") if v.where.endswith("luciferin")]
    lost = [v for v in beside if "another map" in v.why]
    assert {v.verdict for v in lost} == {"not reproducible"}
    assert [v.printed for v in lost if v.printed != "10000.0"] == ["17.344", "18.279", "15.695", "16.465"]
    assert len(lost) == 12
    assert not any(v.verdict == "misprint" for v in beside)
    assert by_where("4.3")["neighbour, 22, luciferin"].ours == "12.0075"


def test_the_probable_swap_of_table_4_10_is_told_with_what_tells_against_it() -> None:
    ten = by_where("4.10")
    for method in ("mixed", "improved"):
        why = ten[f"{method}: iterations"].why
        assert "the 4 of mixed and the 12 of improved are probably swapped" in why
        assert "12 iterations of mixed can add up to its 98.2 (55.8 to 127.4)" in why
        assert "improved needs 5 and not 4, which leave 42 of its 53.4 at most" in why
    assert "swapped" not in ten["ad-gso: iterations"].why
    assert ten["mixed: path cost"].ours == "no sum has 4 iterations"


def test_reductions_are_told_of_both_the_printed_and_the_exact_means() -> None:
    text = {r["id"]: v for r, v in zip(printed_data.rows("text"), printed.verdicts("text"), strict=True)}
    for name, exact, of_printed in (
        ("less-time-mixed", "80.0249", "79.18"),
        ("less-time-improved", "53.2341", "54.69"),
        ("less-iterations-mixed", "77.1089", "77.03"),
    ):
        assert text[name].ours == exact
        assert of_printed in text[name].why


def test_a_change_of_our_code_changes_verdicts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(walk, "AdGso", lambda: AdGso(mvr=2))
    assert tuple(count(walk.walk("4.3")).values()) != FOUND["4.3"]


def test_claims_agree_with_those_worked_out_apart() -> None:
    """``claims_recomputed`` of the audit, by hand and by another program, against ours."""
    text = {r["id"]: v for r, v in zip(printed_data.rows("text"), printed.verdicts("text"), strict=True)}
    known = {
        "iterations-mixed": 84.1667, "cost-mixed": 3189.4433, "time-mixed": 24.8543,
        "iterations-improved": 29.4667, "cost-improved": 1069.3333, "time-improved": 10.616,
        "iterations-ad-gso": 19.2667, "cost-ad-gso": 65.22, "time-ad-gso": 4.9647,
        "less-iterations-mixed": 77.11, "less-iterations-improved": 34.62,
        "guide-mean": 49.818, "dynamic-mean": 49.545, "path1-mean": 48.583, "path2-mean": 55.059,
        "guide-cost": 12.4, "guide-avoid-cost": 13.2,
    }  # fmt: skip
    for name, value in known.items():
        assert float(text[name].ours) == pytest.approx(value, abs=0.006), name
