"""Files of sources: what they may hold, and errors with their place."""

from __future__ import annotations

from pathlib import Path

import pytest

import lampyris
from lampyris.errors import FileError, LimitError
from lampyris.io import source_files

YAML = """sources:
  - {kind: inverse-square, at: [12, 30.5], core: 3}
  - {kind: plume, at: [40, 10], strength: 2, towards: 1.57, route: [[40, 30]], speed: 0.05}
  - {kind: three-peaks, centre: [25, 25], width: 50, height: 40}
"""


def put(folder: Path, text: str, name: str = "s.yaml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_kinds_and_their_fields(tmp_path: Path) -> None:
    made = lampyris.load_sources(put(tmp_path, YAML))
    assert made == (
        lampyris.InverseSquare((12.0, 30.5), core=3.0),
        lampyris.Plume((40.0, 10.0), strength=2.0, towards=1.57, route=[(40.0, 30.0)], speed=0.05),
        lampyris.ThreePeaks((25.0, 25.0), 50.0, 40.0),
    )
    same = '{"sources": [{"kind": "inverse-square", "at": [12, 30.5], "core": 3}]}'
    assert lampyris.load_sources(put(tmp_path, same, "s.json")) == made[:1]


@pytest.mark.parametrize(
    ("text", "place", "word"),
    [
        ("sources: []\n", "1:10", "sources"),
        ("targets: 1\n", "1:1", "targets"),
        ("sources: [3]\n", "1:11", "3"),
        ("sources:\n  - {kind: inverse-sqare, at: [1, 2]}\n", "2:12", "did you mean inverse-square"),
        ("sources:\n  - {kind: plume}\n", "2:5", "no at"),
        ("sources:\n  - {kind: plume, at: [1, 2], wdth: 2}\n", "2:31", "did you mean width"),
        ("sources:\n  - {kind: plume, at: [1, 2], width: -2}\n", "2:38", "width"),
        ("sources:\n  - {kind: plume, at: [1]}\n", "2:23", "at"),
        ("sources:\n  - {kind: plume, at: [1, 2], route: [[1]]}\n", "2:38", "route"),
    ],
)
def test_errors_have_a_place(tmp_path: Path, text: str, place: str, word: str) -> None:
    path = put(tmp_path, text)
    with pytest.raises(FileError, match=r"SOURCES") as caught:
        lampyris.load_sources(path)
    assert f"{path}:{place}" in str(caught.value)
    assert word in str(caught.value)


def test_a_file_that_is_too_large_is_refused(tmp_path: Path) -> None:
    head, more = "sources: [{kind: plume, at: [1, 2]}]\n", source_files.MAX_BYTES
    right = put(tmp_path, head + "#" * (more - len(head)))
    assert len(lampyris.load_sources(right)) == 1
    with pytest.raises(LimitError):
        lampyris.load_sources(put(tmp_path, head + "#" * (more - len(head) + 1)))


@pytest.mark.nightly
def test_a_file_of_too_many_values_is_refused(tmp_path: Path) -> None:
    """Each source here is four values at least."""
    line = "- {kind: plume, at: [1, 2]}\n"
    assert len(lampyris.load_sources(put(tmp_path, "sources:\n" + line * 1000))) == 1000
    with pytest.raises((LimitError, FileError)):
        lampyris.load_sources(put(tmp_path, "sources:\n" + line * (source_files.MAX_VALUES // 4)))
