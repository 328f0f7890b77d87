"""Records that are sealed and yet no such thing: damage wherever they are met; repair leaves them out."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import pytest
from store_samples import bytes_of, filled, rows, study

from lampyris.errors import InternalFault, LampyrisError
from lampyris.study.design.row import Row
from lampyris.study.store.file import HEAD, chained, seal
from lampyris.study.store.repair import repair
from lampyris.study.store.store import Store, open_for


def forge(path: Path, n: int, **columns: str) -> None:
    """Change the columns of run ``n``, and every seal and head that would tell of it."""
    db = sqlite3.connect(path)
    for name, value in columns.items():
        db.execute(f"UPDATE runs SET {name} = ? WHERE n = ?", (value, n))
    texts = db.execute("SELECT key, ending, error, metrics, timing FROM runs WHERE n = ?", (n,)).fetchone()
    db.execute("UPDATE runs SET seal = ? WHERE n = ?", (seal("runs", *texts), n))
    head = HEAD
    for (one,) in db.execute("SELECT seal FROM runs ORDER BY n").fetchall():
        head = chained(head, one)
    (count,) = db.execute("SELECT count FROM tally").fetchone()
    db.execute("UPDATE tally SET seal = ?, head = ?", (seal("tally", count, head), head))
    db.commit()
    db.close()


def forge_one(path: Path, table: str, *texts: str) -> None:
    """Put other texts into the first record of a table, sealed."""
    columns = {"meta": ("name", "value"), "maps": ("hash", "value"), "tally": ("count", "head")}[table]
    db = sqlite3.connect(path)
    db.execute(
        f"UPDATE {table} SET seal = ?, {columns[0]} = ?, {columns[1]} = ? WHERE n = 1",
        (seal(table, *texts), *texts),
    )
    db.commit()
    db.close()


def read_all(path: Path, *, writable: bool) -> None:
    """Open it, and read everything."""
    with Store.open(path, writable=writable) as store:
        store.study()
        store.rows()


def refused(path: Path, code: str, word: str = "error") -> None:
    """Reading, writing and going on are refused in one line each, and nothing is changed."""
    before = bytes_of(path)[""]
    for writable in (False, True):
        with pytest.raises(LampyrisError, match=word) as caught:
            read_all(path, writable=writable)
        assert caught.value.code == code
        assert str(caught.value).isprintable()
    with pytest.raises(LampyrisError) as caught, open_for(path, study()):
        pass
    assert caught.value.code in (code, "STORE_OTHER")
    assert bytes_of(path)[""] == before


@pytest.mark.parametrize(("columns", "word"), [
    ({"ending": "won"}, "it ended 'won'"),
    ({"ending": ""}, "it ended ''"),
    ({"metrics": "no JSON"}, "metrics are no JSON"),
    ({"timing": ""}, "timing are no JSON"),
    ({"metrics": "[" * 5000}, "metrics are no JSON"),
    ({"metrics": "[]"}, "metrics are no table"),
    ({"timing": "7"}, "timing are no table"),
    ({"metrics": '{"cost":NaN}'}, "metrics.cost is neither"),
    ({"metrics": '{"cost":-Infinity}'}, "metrics.cost is neither"),
    ({"metrics": '{"cost":1e999}'}, "metrics.cost is neither"),
    ({"timing": '{"cpu_s":NaN}'}, "timing.cpu_s is neither"),
    ({"metrics": '{"cost":[1]}'}, "metrics.cost is neither"),
    ({"metrics": '{"cost":1' + 40 * "0" + "}"}, "metrics.cost is neither"),
    ({"metrics": '{"cost":1' + 9000 * "0" + "}"}, "metrics are no JSON"),
])  # fmt: skip
def test_a_sealed_run_that_is_no_row_is_damage(tmp_path: Path, columns: dict[str, str], word: str) -> None:
    path = tmp_path / "a"
    given = filled(path, study())
    forge(path, 8, **columns)
    refused(path, "STORE_DAMAGED", f"record 8 is sealed, and no row: .*{word}")
    told = repair(path)
    assert (told.kept, told.lost) == (len(given) - 1, 1)
    with open_for(path, study()) as store:
        assert store.add(given) == 1
        assert store.rows() == {row.key: row for row in given}


@pytest.mark.parametrize("count", ["040", "-40", "4e1", "", "forty", "٤٠", "9" * 30])
def test_a_sealed_tally_that_is_no_number_is_damage(tmp_path: Path, count: str) -> None:
    path = tmp_path / "a"
    given = filled(path, study())
    db = sqlite3.connect(path)
    (head,) = db.execute("SELECT head FROM tally").fetchone()
    db.close()
    forge_one(path, "tally", count, head)
    refused(path, "STORE_DAMAGED", "tally: no number of runs")
    assert repair(path).kept == len(given)
    with open_for(path, study()) as store:
        assert store.rows() == {row.key: row for row in given}


@pytest.mark.parametrize("text", ["", "[]", "no JSON", '{"seeds":NaN}', '{"seeds":1e999}', "[" * 5000])
def test_a_sealed_study_that_is_no_table_is_damage(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a"
    given = filled(path, study())
    forge_one(path, "meta", "study", text)
    refused(path, "STORE_DAMAGED", "the study is no table")
    with pytest.raises(LampyrisError, match="STORE_STUDY"):
        repair(path)
    assert repair(path, study=study()).kept == len(given)


@pytest.mark.parametrize("maps", [None, 7, [], [7], [{"hash": 7}], {"a": "b"}])
def test_a_sealed_study_with_maps_of_another_form_asks_for_the_study(tmp_path: Path, maps: object) -> None:
    path = tmp_path / "a"
    given = filled(path, study())
    with Store.open(path, writable=False) as store:
        plain = store.plain()
    forge_one(path, "meta", "study", json.dumps({**plain, "maps": maps}))
    refused(path, "STUDY_MAP" if maps == [{"hash": 7}] else "STUDY_PLAIN")
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(LampyrisError, match="STORE_STUDY"):
        repair(path)
    assert repair(path, study=study()).kept >= len(given) - 20


@pytest.mark.parametrize("what", ["worlds", "planners", "laws", "crowds", "seeds"])
def test_a_sealed_study_of_no_runs_is_no_study(tmp_path: Path, what: str) -> None:
    path = tmp_path / "a"
    filled(path, study())
    with Store.open(path, writable=False) as store:
        plain = store.plain()
    called = {**plain["called"], what: []} if what in plain["called"] else plain["called"]
    forge_one(path, "meta", "study", json.dumps({**plain, what: [], "called": called}))
    refused(path, "STUDY_PLAIN", f"no {what}")


def test_a_sealed_map_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a"
    filled(path, study())
    with Store.open(path, writable=False) as store:
        key = next(iter(store.maps()))
    for text in ("", "[]", '{"blocked":7}', "{}"):
        forge_one(path, "maps", key, text)
        with pytest.raises(LampyrisError) as caught, Store.open(path, writable=False) as store:
            store.study()
        assert caught.value.code in ("STORE_DAMAGED", "PACKED_MAP")


@pytest.mark.parametrize("row", [
    Row("k", "won"), Row("k", "done", {"cost": 2**63}), Row("k", "done", {"cost": float("nan")}),  # type: ignore[arg-type]
    Row("k", "done", {"cost": [1]}), Row("k", "done", {}, {"cpu_s": float("inf")}),
])  # fmt: skip
def test_what_could_not_be_read_again_is_not_stored(tmp_path: Path, row: Row) -> None:
    with Store.create(tmp_path / "a", study()) as store:
        with pytest.raises(InternalFault, match="STORE_ROW"):
            store.add([rows(study())[0], row])
        assert store.rows() == {}
        assert store.add(rows(study())) == 40
