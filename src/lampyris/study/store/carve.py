"""Carve: find a store's records in bytes that SQLite cannot, or should not, be trusted with.

A record begins with a head that gives the length of each of its columns; ours all begin alike, with a number
and a seal. Wherever such a head is found, in a page or in a frame of the log, in its place or not, the
columns are read, and the record counts if its seal holds. The tree above the records, the lists of their
places and the checksums of the log are not needed. The format is that of
https://www.sqlite.org/fileformat2.html, sections 1.6, 2.1 and 4.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TypeAlias

from lampyris.study.store.file import MAX_VALUE, PAGE, WIDTHS, seal

Found: TypeAlias = tuple[str, tuple[str, ...]]
"""Table and columns of a record, the seal first."""

_HEAD = re.compile(rb"(?=[\x05-\x30]\x00\x81\x0d)")
"""Length of the head; the number, which SQLite keeps elsewhere; a text of 64 bytes, the seal."""
_BY_WIDTH = {w: [table for table, width in WIDTHS.items() if width == w] for w in WIDTHS.values()}
_LOCAL = PAGE - 35
_LEAST = (PAGE - 12) * 32 // 255 - 23
_LOG_HEAD = 32
_FRAME = 24


def carved(main: bytes, log: bytes) -> Iterator[Found]:
    """Every record whose seal holds, in the main file and then in the log; one may come more than once.

    Parameters
    ----------
    main, log : the bytes of both, or what is left of them; anything that can be indexed as bytes can.
    """
    pages = {k + 1: (main, k * PAGE) for k in range(len(main) // PAGE + 1)}
    newer = dict(pages)
    for at in range(_LOG_HEAD, len(log) - _FRAME, _FRAME + PAGE):
        newer[int.from_bytes(log[at : at + 4], "big")] = (log, at + _FRAME)
    for data in (main, log):
        for match in _HEAD.finditer(data):
            # A long record goes on in other pages; of two that are said to be the same one may be damaged.
            for way in (newer, pages) if log else (pages,):
                found = _record(data, match.start(), way)
                if found is not None:
                    yield found
                    break


def _record(data: bytes, at: int, pages: dict[int, tuple[bytes, int]]) -> Found | None:
    """The record whose head is there, if its seal holds."""
    lengths = _lengths(data[at : at + data[at]])
    if lengths is None or len(lengths) - 1 not in _BY_WIDTH:
        return None
    body = _body(data, at, data[at] + sum(lengths), pages)
    if body is None:
        return None
    texts, k = [], data[at]
    try:
        for length in lengths:
            texts.append(body[k : k + length].decode())
            k += length
    except UnicodeDecodeError:
        return None
    for table in _BY_WIDTH[len(texts) - 1]:
        if seal(table, *texts[1:]) == texts[0]:
            return table, tuple(texts)
    return None


def _lengths(head: bytes) -> list[int] | None:
    """Lengths in bytes of the texts of a record, its number left out; None if they are not all texts."""
    lengths, k = [], 2
    while k < len(head):
        value = 0
        for _ in range(5):  # no text of ours needs more
            if k == len(head):
                return None
            value, k = value << 7 | head[k] & 0x7F, k + 1
            if head[k - 1] < 0x80:
                break
        else:
            return None
        if value < 13 or not value % 2 or value > 2 * MAX_VALUE:
            return None
        lengths.append((value - 13) // 2)
    return lengths


def _body(data: bytes, at: int, size: int, pages: dict[int, tuple[bytes, int]]) -> bytes | None:
    """All bytes of a record, from wherever they continue; None if they end early."""
    local = size
    if size > _LOCAL:
        local = _LEAST + (size - _LEAST) % (PAGE - 4)
        local = local if local <= _LOCAL else _LEAST
    parts, left = [bytes(data[at : at + local])], size - local
    following = int.from_bytes(data[at + local : at + local + 4], "big")
    while left > 0:
        source, start = pages.get(following, (b"", 0))
        part = bytes(source[start + 4 : start + 4 + min(left, PAGE - 4)])
        if not part:
            return None
        following = int.from_bytes(source[start : start + 4], "big")
        parts.append(part)
        left -= len(part)
    body = b"".join(parts)
    return body if len(body) == size else None
