"""run_study: in memory, with a store that goes on, and what it refuses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import lampyris
from lampyris.errors import FileError, SettingError
from lampyris.study.execution.execution import Progress

TEXT = """\
version: 1
name: s
maps:
  - {bundled: guide, queries: [{start: [0, 9], goal: [7, 0]}]}
planners: [astar, ad-gso]
seeds: 2
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "s.yaml").write_text(TEXT)
    return tmp_path / "s.yaml"


def test_a_file_a_study_and_a_store_give_the_same_table(file: Path) -> None:
    store = file.with_suffix(".study.db")
    study = lampyris.load_study(file)
    assert isinstance(study, lampyris.Study)
    tables = [lampyris.run_study(file), lampyris.run_study(study), lampyris.run_study(str(file), store)]
    lines = [list(table.lines()) for table in tables]
    assert lines[0] == lines[1] == lines[2]
    assert (len(tables[0]), tables[0].missing) == (4, 0)
    assert tables[0]["planner"] == ["astar", "ad-gso"] * 2


def test_what_a_store_has_is_not_run_again(file: Path) -> None:
    store = file.with_suffix(".study.db")
    lampyris.run_study(file, store)
    told: list[Progress] = []
    lampyris.run_study(file, store, progress=told.append)
    assert told[0].done == told[0].total == 4
    assert not any(p.rows for p in told)
    file.write_text(TEXT.replace("seeds: 2", "seeds: 3"))
    with pytest.raises(FileError, match=r"^error\[STORE_OTHER\]: .*seeds"):
        lampyris.run_study(file, store)


def test_what_is_no_study_is_refused() -> None:
    wrong: Any = 7
    with pytest.raises(SettingError, match="a int"):
        lampyris.run_study(wrong)
    with pytest.raises(FileError, match="FILE_MISSING"):
        lampyris.run_study("no-such-study")
