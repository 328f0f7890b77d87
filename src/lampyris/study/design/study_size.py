"""How large a study may be, and what it is called: the same for studies of one robot and of fleets."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lampyris.errors import LimitError

if TYPE_CHECKING:
    from lampyris.io.scenario.validation_errors import Document
    from lampyris.study.design.schema import StudyFile

MAX_JOBS = 10_000_000


def check_size(parsed: Document, sizes: dict[str, int]) -> None:
    """Refuse a study of more jobs than can be run.

    Raises
    ------
    LimitError : LIMIT, with what is multiplied.
    """
    jobs = 1
    for many in sizes.values():
        jobs *= many
    if jobs > MAX_JOBS:
        parts = " x ".join(f"{many:,} {what}" for what, many in sizes.items())
        raise LimitError(
            "LIMIT",
            f"{jobs:,} runs or more: {parts}",
            where=parsed.at(),
            allowed=f"at most {MAX_JOBS:,}",
            todo="take fewer seeds, values of grids or queries (`limit`)",
        )


def name_of(parsed: Document, file: StudyFile) -> str:
    """What the study is called: by its file where it has no name."""
    return file.name or Path(parsed.where.removesuffix(" (ready)")).stem[:64]
