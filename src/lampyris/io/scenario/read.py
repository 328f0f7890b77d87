"""Reading a scenario: from a file, or from plain data, to nouns.

A file is read as YAML or JSON, checked by the models of :mod:`lampyris.io.scenario.schema`, and made into
nouns by :mod:`lampyris.io.scenario.build`. Both need pydantic and are imported when a file is read.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import FileError, LimitError, file_name, of_kind
from lampyris.io.files import read_regular
from lampyris.io.scenario.scenario import MapSource, Scenario
from lampyris.io.text.csv_table import MAX_BYTES
from lampyris.model.edit import MAX_EDITS
from lampyris.model.traffic import MAX_OBSTACLES

if TYPE_CHECKING:
    from lampyris.io.maps.formats.document import MapDocument
    from lampyris.io.scenario.build import Names
    from lampyris.io.scenario.map_source import Files
    from lampyris.io.scenario.validation_errors import Document


def open_scenario(
    path: str | os.PathLike[str], *, allow_outside: bool = False, max_cells: int = MAX_CELLS
) -> tuple[Document, Files]:
    """A scenario file as plain data, JSON if its name ends in ``.json``, YAML otherwise; and the files that it may name.

    Parameters
    ----------
    path : the file. What it names is relative to its folder.
    allow_outside : whether it may name files outside its folder.
    max_cells : maps of more cells are refused.

    Raises
    ------
    LampyrisError : it cannot be read.
    """
    from lampyris.io.maps.formats.document import check_limit
    from lampyris.io.scenario.map_source import Files
    from lampyris.io.scenario.schema import VERSION

    check_limit(max_cells)
    of_kind("allow_outside", allow_outside, bool)
    parsed = read_document(file_name("path", path), VERSION)
    return parsed, Files(parsed, allow_outside, max_cells)


def scenario_in(parsed: Document, names: Names, files: Files) -> Scenario:
    """The scenario that a file says.

    Parameters
    ----------
    parsed, files : of :func:`open_scenario`.
    names : the known planners and laws.

    Raises
    ------
    LampyrisError : the first mistake in the file; the others are its notes, a line each.
    """
    return _built(parsed, names, lambda: files)


def scenario_of(
    data: dict[str, Any],
    names: Names,
    *,
    where: str = "scenario",
    given: MapDocument | None = None,
    source: MapSource | None = None,
    max_cells: int = MAX_CELLS,
) -> Scenario:
    """A scenario from plain data that is in no file; nothing that it names is opened.

    Parameters
    ----------
    data : what a scenario file holds. Lists of tracks and maps in files of their own are refused.
    names : the known planners and laws.
    where : what to call it in messages, before the JSON pointer.
    given : the map, whatever ``data`` says of it; None: bundled, made by a recipe or written out in rows.
    source : where the given map comes from; None: from its cells.
    max_cells : maps of more cells are refused.

    Raises
    ------
    LampyrisError : the first mistake; the others are its notes.
    """
    from lampyris.io.scenario.map_source import NoFiles
    from lampyris.io.scenario.schema import VERSION
    from lampyris.io.scenario.validation_errors import PlainDocument

    parsed = PlainDocument(data, where)
    check_version(parsed, VERSION)
    return _built(parsed, names, lambda: NoFiles(parsed, max_cells, given, source))


def _built(parsed: Document, names: Names, files: Callable[[], Files]) -> Scenario:
    from pydantic import ValidationError

    from lampyris.io.scenario.build import build
    from lampyris.io.scenario.schema import ScenarioFile
    from lampyris.io.scenario.validation_errors import faults_of, raise_all, spot

    for key, most in (("obstacles", MAX_OBSTACLES), ("edits", MAX_EDITS)):
        given = parsed.data.get(key)
        if isinstance(given, list) and len(given) > most:
            what = f"{len(given):,} {key}"
            raise LimitError("LIMIT", what, where=spot(parsed, (key,)), allowed=f"at most {most:,}")
    try:
        file = ScenarioFile.model_validate(parsed.data)
    except ValidationError as problem:
        raise_all(faults_of(parsed, problem), problem.error_count())
    return build(parsed, file, names, files())


def read_document(name: str, version: int) -> Document:
    """A file as plain data, every value with its place: JSON if its name ends in ``.json``, YAML otherwise.

    Raises
    ------
    FileError : what is wrong with it; VERSION: it has another version than this. Of no other key is said
        anything then: each might be called unknown.
    LimitError : it is too large.
    """
    parsed = read_plain(name)
    check_version(parsed, version)
    return parsed


def check_version(parsed: Document, version: int) -> None:
    """Refuse another version than this.

    Raises
    ------
    FileError : VERSION.
    """
    from lampyris.io.scenario.validation_errors import brief, spot

    given = parsed.data.get("version", version)
    if isinstance(given, bool) or given != version:
        newer = isinstance(given, int) and given > version
        raise FileError(
            "VERSION",
            brief(given) + (": made for a newer release" if newer else ""),
            where=spot(parsed, ("version",)),
            allowed=f"version {version}",
        )


def read_plain(name: str) -> Document:
    """A file as plain data, whatever its keys; see :func:`read_document`."""
    as_json = Path(name).suffix.lower() == ".json"
    try:
        data = read_regular(name, MAX_BYTES)
    except LimitError as large:
        code = "JSON_SIZE" if as_json else "YAML_SIZE"
        raise LimitError(code, large.what, where=large.where, allowed=large.allowed) from None
    if as_json:
        from lampyris.io.text.strict_json import read_json

        return read_json(data, name)
    from lampyris.io.text.strict_yaml import read_yaml

    return read_yaml(data, name)
