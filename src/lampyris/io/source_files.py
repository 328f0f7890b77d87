"""Files of sources: what a swarm of robots looks for, as a list in YAML or JSON."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lampyris.errors import FileError, SettingError, did_you_mean
from lampyris.io.files import read_regular
from lampyris.io.text.strict_json import JsonDocument, read_json
from lampyris.io.text.strict_yaml import YamlDocument, read_yaml, shown
from lampyris.model.swarm.sources import AnySource, InverseSquare, Plume, ThreePeaks

MAX_BYTES = 2**20
MAX_VALUES = 20_000
"""Some 1,000 sources."""
KINDS: Mapping[str, type[AnySource]] = MappingProxyType(
    {"inverse-square": InverseSquare, "plume": Plume, "three-peaks": ThreePeaks}
)
"""What a file calls the kinds of sources."""


def read_sources(path: str | os.PathLike[str]) -> tuple[AnySource, ...]:
    """The sources of a file: a list ``sources`` of mappings with ``kind`` and the fields of that kind.

    ::

        sources:
          - {kind: inverse-square, at: [12, 30], core: 3}
          - {kind: plume, at: [40, 10], strength: 2, towards: 1.57, route: [[40, 30]], speed: 0.05}

    Lengths are metres of the map frame.

    Parameters
    ----------
    path : ``.json`` is JSON, all else YAML.

    Raises
    ------
    FileError : ``SOURCES``: not such a file, or a value out of its range; what the readers of YAML and JSON say. With line and
        column.
    LimitError : a file that is too large.
    """
    name = os.fspath(path)
    data = read_regular(name, MAX_BYTES)
    document: JsonDocument | YamlDocument
    if Path(name).suffix.lower() == ".json":
        document = read_json(data, name)
    else:
        document = read_yaml(data, name, max_bytes=MAX_BYTES, max_values=MAX_VALUES)
    for key in document.data:
        if key != "sources":
            raise FileError(
                "SOURCES", f"unknown key {shown(key)}", where=document.at_key(key), allowed="sources"
            )
    listed = document.data.get("sources")
    if not isinstance(listed, list) or not listed:
        raise FileError("SOURCES", shown(listed), where=document.at("sources"), allowed="a list of sources")
    return tuple(_source(document, k, one) for k, one in enumerate(listed))


def _source(document: JsonDocument | YamlDocument, k: int, given: Any) -> AnySource:
    if not isinstance(given, dict):
        allowed = "a mapping with kind and at"
        raise FileError("SOURCES", shown(given), where=document.at("sources", k), allowed=allowed)
    word = given.get("kind")
    kind = KINDS.get(word) if isinstance(word, str) else None
    if kind is None:
        raise FileError(
            "SOURCES", shown(word), where=document.at("sources", k, "kind"), allowed=", ".join(KINDS),
            todo=did_you_mean(word, KINDS) if isinstance(word, str) else "",
        )  # fmt: skip
    names = [f.name for f in fields(kind)]
    for key in given:
        if key not in (*names, "kind"):
            raise FileError(
                "SOURCES", f"unknown key {shown(key)}", where=document.at_key("sources", k, key),
                allowed=", ".join(("kind", *names)), todo=did_you_mean(key, names),
            )  # fmt: skip
    first = names[0]
    if first not in given:
        raise FileError("SOURCES", f"no {first}", where=document.at("sources", k), allowed=f"{first}: [x, y]")
    try:
        return kind(**{key: value for key, value in given.items() if key != "kind"})
    except SettingError as fault:
        field = fault.where.partition("[")[0]
        where = document.at("sources", k, field) if field in given else document.at("sources", k)
        raise FileError(
            "SOURCES", f"{fault.where} {fault.what}", where=where, allowed=fault.allowed
        ) from None
