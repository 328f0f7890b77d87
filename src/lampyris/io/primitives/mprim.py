"""Motion primitives as SBPL reads them: ``.mprim``.

Words and numbers between white space::

    resolution_m: 0.1
    numberofangles: 16
    totalnumberofprimitives: 1
    primID: 0
    startangle_c: 0
    endpose_c: 1 0 0
    additionalactioncostmult: 1
    intermediateposes: 2
    0.0000 0.0000 0.0000
    0.1000 0.0000 0.0000

``endpose_c`` is a cell and a heading, which may be counted from below 0; the poses are metres and radians, the first and the
last included. Headings are 2 pi / ``numberofangles`` apart, unless lines ``angle:NUMBER RADIANS`` give them, as newer
generators do (with ``min_turning_radius_m``, and ``turning_radius`` of each primitive).
"""

from __future__ import annotations

import math
import re

from lampyris.errors import FileError, LimitError, SettingError
from lampyris.io.primitives.checked import CheckedMotions, enough_headings
from lampyris.io.text.strict_yaml import shown
from lampyris.model.lattice.motion_primitives import MAX_MOTIONS, MAX_POSES, MotionPrimitives, headings_of

FIRST_WORD = "resolution_m:"
_MOST_WORDS = 3 * MAX_POSES + 20 * MAX_MOTIONS
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d{1,3})?", re.ASCII)
_WHOLE = re.compile(r"[-+]?\d{1,9}", re.ASCII)


def looks_like_mprim(data: bytes) -> bool:
    """Whether a file is of this format, rightly or wrongly written."""
    return data.removeprefix(b"\xef\xbb\xbf").lstrip()[: len(FIRST_WORD)] == FIRST_WORD.encode()


def read_mprim(data: bytes, name: str) -> MotionPrimitives:
    """The primitives of a file.

    Raises
    ------
    FileError : with the line.
    LimitError : too large.
    """
    return _Words(data, name).primitives()


class _Words:
    def __init__(self, data: bytes, name: str) -> None:
        self._name, self._at = name, 0
        self._words: list[tuple[str, int]] = []
        for line, text in enumerate(data.removeprefix(b"\xef\xbb\xbf").split(b"\n"), 1):
            try:
                words = text.decode("ascii").split()
            except UnicodeDecodeError as problem:
                where = f"{name}:{line}:{problem.start + 1}"
                raise FileError("PRIMITIVE", "not ASCII", where=where, allowed="words and numbers") from None
            self._words += [(word, line) for word in words]
            if len(self._words) > _MOST_WORDS:
                raise LimitError(
                    "LIMIT",
                    "too many words",
                    where=f"{name}:{line}",
                    allowed=f"{MAX_MOTIONS:,} primitives, of {MAX_POSES:,} poses in all",
                )

    def primitives(self) -> MotionPrimitives:
        """The primitives of the whole file."""
        self._key(FIRST_WORD)
        resolution = self._number(1e-6, 1000.0)
        radius = 0.0
        if self._next() == "min_turning_radius_m:":
            self._key("min_turning_radius_m:")
            radius = self._number(0.0, 1e6)
        self._key("numberofangles:")
        count = self._whole(1, 10**6)
        enough_headings(count, self._where())
        headings = self._headings(count)
        self._key("totalnumberofprimitives:")
        total = self._whole(1, 10**9)
        stated = self._where()
        motions = CheckedMotions(self._name, resolution, headings)
        while self._at < len(self._words):
            self._motion(motions)
        if len(motions.made) != total:
            raise FileError(
                "PRIMITIVE",
                f"{total:,} primitives stated, {len(motions.made):,} in the file",
                where=stated,
                allowed="the number of primitives",
            )
        return motions.primitives(opposite=False, turn_radius=radius)

    def _headings(self, count: int) -> tuple[float, ...]:
        if not self._next().startswith("angle:"):
            return tuple(2 * math.pi * k / count for k in range(count))
        found = []
        for k in range(count):
            self._key(f"angle:{k}")
            found.append(self._number(-1e3, 1e3))
        try:
            return headings_of(found)
        except SettingError as fault:
            raise FileError("PRIMITIVE", fault.what, where=self._where(), allowed=fault.allowed) from None

    def _motion(self, motions: CheckedMotions) -> None:
        n = len(motions.headings)
        self._key("primID:")
        where = f"{self._where()}:1"
        number = self._whole(0, 10**9)
        self._key("startangle_c:")
        start = self._whole(0, n - 1)
        self._key("endpose_c:")
        x, y = self._whole(-10_000, 10_000), self._whole(-10_000, 10_000)
        end = self._whole(-n, 2 * n) % n
        self._key("additionalactioncostmult:")
        price = self._number(1e-3, 1e6)
        if self._next() == "turning_radius:":
            self._key("turning_radius:")
            self._number(-1e6, 1e6)
        self._key("intermediateposes:")
        count = self._whole(2, MAX_POSES)
        if 3 * count > len(self._words) - self._at:
            raise self._refuse(f"{count} poses stated, and the file ends before", "as many poses")
        poses = [
            (self._number(-1e6, 1e6), self._number(-1e6, 1e6), self._number(-1e3, 1e3)) for _ in range(count)
        ]
        motions.add(number, (start, end), (x, y), poses, price, where)

    # ---- words --------------------

    def _next(self) -> str:
        return self._words[self._at][0] if self._at < len(self._words) else ""

    def _take(self, allowed: str) -> str:
        if self._at >= len(self._words):
            raise self._refuse("the file ends", allowed)
        self._at += 1
        return self._words[self._at - 1][0]

    def _key(self, word: str) -> None:
        found = self._take(word)
        if found != word:
            raise self._refuse(shown(found), word)

    def _number(self, low: float, high: float) -> float:
        allowed = f"a number, {low:g} to {high:g}"
        word = self._take(allowed)
        if len(word) > 40 or not _NUMBER.fullmatch(word) or not low <= float(word) <= high:
            raise self._refuse(shown(word), allowed)
        return float(word)

    def _whole(self, low: int, high: int) -> int:
        allowed = f"a whole number, {low:,} to {high:,}"
        word = self._take(allowed)
        if not _WHOLE.fullmatch(word) or not low <= int(word) <= high:
            raise self._refuse(shown(word), allowed)
        return int(word)

    def _where(self) -> str:
        at = min(max(self._at - 1, 0), len(self._words) - 1)
        return f"{self._name}:{self._words[at][1] if self._words else 1}"

    def _refuse(self, what: str, allowed: str) -> FileError:
        return FileError("PRIMITIVE", what, where=self._where(), allowed=allowed)
