"""Maps as rows of characters: one reader for MovingAI and for plain text, which differ in their tables."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lampyris.io.maps.formats.document import BAD, CodeGrid, FileSource, first_bad, look_up


def code_table(meaning: Mapping[str, int]) -> CodeGrid:
    """The code of each byte, BAD for the characters that mean nothing."""
    table = np.full(256, BAD, dtype=np.uint8)
    for character, code in meaning.items():
        table[ord(character)] = code
    return table


def read_rows(
    source: FileSource, start: int, line: int, width: int, height: int, meaning: Mapping[str, int]
) -> CodeGrid:
    """The codes of a raster of characters, uint8 (height, width).

    Parameters
    ----------
    start : offset of the first row in ``source.data``.
    line : its line number, counted from 1.
    width, height : how many characters and rows there must be. Blank lines may follow.
    meaning : the code of each character.

    Raises
    ------
    FileError : a short, long, missing or further row, a character without meaning; with line and column.
    """
    data = source.data
    if b"\r" in data:
        # A carriage return anywhere else than at an end of line stays in its row and is refused there.
        data = data[start:].replace(b"\r\n", b"\n")
        start = 0
    stride = width + 1
    flat = np.frombuffer(data, dtype=np.uint8, offset=start)
    newline = np.uint8(ord("\n"))
    even = flat.size >= height * stride - 1 and not data[start + height * stride :].strip()
    if even:
        if flat.size < height * stride:
            flat = np.append(flat, newline)  # the last line may lack its end
        lines = flat[: height * stride].reshape(height, stride)
        even = bool((lines[:, width] == newline).all())
    if not even:
        raise _uneven(source, data[start:], line, width, height, meaning)
    rows = lines[:, :width]
    codes = look_up(code_table(meaning), rows)
    if codes.max() == BAD:
        x, y = first_bad(codes == BAD)
        if (rows[y] == newline).any():
            raise _uneven(source, data[start:], line, width, height, meaning)
        raise _character(source, line + y, x, int(rows[y, x]), meaning)
    return codes


def _uneven(
    source: FileSource, body: bytes, line: int, width: int, height: int, meaning: Mapping[str, int]
) -> Exception:
    """What is wrong with rows that do not all have the same length."""
    rows = body.split(b"\n")
    while rows and not rows[-1].strip():
        rows.pop()
    for y, row in enumerate(rows[:height]):
        if len(row) == width:
            continue
        for x, value in enumerate(row[:width]):
            if chr(value) not in meaning and value not in b" \t\r":
                return _character(source, line + y, x, value, meaning)
        if len(row) < width:
            return source.error(
                "MAP_TRUNCATED",
                f"row {y + 1} has {len(row)} of {width} cells",
                f"line {line + y}",
                f"{width} cells",
            )
        return source.error("MAP_ROW", f"{len(row)} cells", f"line {line + y}", f"{width}, the width")
    if len(rows) < height:
        return source.error(
            "MAP_TRUNCATED", f"{len(rows)} of {height} rows", f"line {line + len(rows)}", f"{height} rows"
        )
    return source.error(
        "MAP_ROW",
        f"{len(rows)} rows",
        f"line {line + height}",
        f"{height}, the height",
        "take the others away",
    )


def _character(source: FileSource, line: int, x: int, value: int, meaning: Mapping[str, int]) -> Exception:
    shown = repr(chr(value)) if 32 <= value < 127 else f"byte {value}"
    todo = "a free cell is written ." if value in b" \t" else ""
    return source.error("MAP_CELL", shown, f"line {line} column {x + 1}", "one of " + " ".join(meaning), todo)
