"""Ready studies: files of this package that can be run as they are, by their names."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from lampyris.errors import FileError, did_you_mean

_END = ".yaml"


@cache
def names() -> tuple[str, ...]:
    """The names of the ready studies, sorted."""
    found = sorted(one.name for one in (files("lampyris.study.design") / "bundled_studies").iterdir())
    return tuple(name.removesuffix(_END) for name in found if name.endswith(_END))


def text(name: str) -> str:
    """The file of a ready study, comments and all.

    Raises
    ------
    FileError : FILE_MISSING: no ready study of that name.
    """
    if name not in names():
        raise FileError(
            "FILE_MISSING",
            "no ready study of that name",
            where=repr(name[:200]),
            allowed=", ".join(names()),
            todo=did_you_mean(name, names()),
        )
    return (files("lampyris.study.design") / "bundled_studies" / f"{name}{_END}").read_text(encoding="utf-8")


def about(name: str) -> str:
    """What a ready study asks and what it costs, in its own words.

    Raises
    ------
    FileError : FILE_MISSING: no ready study of that name.
    """
    from lampyris.io.text.strict_yaml import read_yaml

    words = str(read_yaml(text(name), f"{name}{_END}").data.get("about", ""))
    return " ".join(words.split())
