"""Mutated files from good ones: seeded, so that a case is known by its target, its seed and its number.

Bytes are turned, set, put in, taken out, repeated and cut off; files of one corpus are spliced; in text,
numbers become odd numbers, words other words, lines are repeated, lost or change places. Where a checksum or
a length stands before what was changed, a repair makes it right again: mutations reach what lies behind.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, TypeVar

import numpy as np

Rng: TypeAlias = np.random.Generator
Change: TypeAlias = "Callable[[Rng, bytes, Corpus], bytes]"
T = TypeVar("T")

MAX_BYTES = 200_000
_PLAIN_NUMBERS = (
    "0 -0 -1 1 00 +5 1.5 .5 1. 1e9 1e-400 1e999 -1e999 nan NaN .nan inf -inf .inf Infinity 0x10"
    " 0o17 010 1_000 1,5 127 128 255 256 32768 65535 65536 2147483647 2147483648 4294967295 4294967296"
    " 9007199254740993 9223372036854775807 9223372036854775808 -9223372036854775809 18446744073709551616"
    ' true null 1:30 2026-01-01 =1+1 "" \u0663 \uff11\uff12 \u00b2 \u22125'
)
NUMBERS = (
    *_PLAIN_NUMBERS.encode().split(),
    *(b"9" * n for n in (30, 310, 5000)),
    b"0." + b"3" * 400,
    b"1e" + b"9" * 30,
)
ODD = (
    *rb'" \ # % & * { } [ ] , : - | > ! ../'.split(),
    *(bytes((b,)) for b in b"\0\r\n\t '\x7f\x0b\x0c\x1a\x1b\x80\xff"),
    *(b"\r\n", b"\x1b[31m", b"\xef\xbb\xbf", b"\xff\xfe", b"\xc3\x28", b"\xed\xa0\x80"),
    *(c.encode() for c in "\U0001f5fa\u2028\x85\u202e\u00e9"),
)
WHOLE = (0, 1, 2, 3, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
BIG_OR_LITTLE: tuple[Literal["big", "little"], ...] = ("big", "little")
_NUMBER = re.compile(rb"[-+]?[0-9][0-9.]*(?:[eE][-+]?[0-9]+)?")
_TOKEN = re.compile(rb"[A-Za-z_][A-Za-z0-9_-]*")


@dataclass(frozen=True)
class Corpus:
    """What the mutants of one parser are made from.

    Parameters
    ----------
    seeds : good files.
    words : what the format's own words are, to be put where other words stand.
    text : whether lines, words and numbers mean something.
    change : a way of changing that knows the format, used four times of five.
    repair : makes checksums and lengths right again. Every fifth mutant is left as it is.
    """

    seeds: tuple[bytes, ...]
    words: tuple[bytes, ...] = ()
    text: bool = True
    change: Change | None = None
    repair: Callable[[bytes], bytes] | None = None

    def mutant(self, rng: Rng) -> bytes:
        """One mutant: mostly one or two changes, seldom more."""
        data = pick(rng, self.seeds)
        for _ in range(1 + int(rng.geometric(0.6) if rng.random() < 0.3 else 0)):
            change: Change = pick(rng, TEXT_CHANGES if self.text and rng.random() < 0.8 else BYTE_CHANGES)
            if self.change is not None and rng.random() < 0.8:
                change = self.change
            data = change(rng, data, self)[:MAX_BYTES]
        if self.repair is not None and rng.random() < 0.8:
            data = self.repair(data)
        return data


def pick(rng: Rng, some: Sequence[T]) -> T:
    """One of them."""
    return some[int(rng.integers(0, len(some)))]


def _span(rng: Rng, data: bytes, most: int = 12) -> tuple[int, int]:
    at = int(rng.integers(0, len(data) + 1))
    return at, min(len(data), at + int(rng.integers(1, most + 1)))


def flip(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Turn one bit."""
    at, to = _span(rng, data, 1)
    return data[:at] + bytes(b ^ 1 << int(rng.integers(0, 8)) for b in data[at:to]) + data[to:]


def put(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Set a few bytes to anything."""
    at, to = _span(rng, data, 4)
    return data[:at] + rng.bytes(to - at) + data[to:]


def insert(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Put a few bytes in."""
    at, to = _span(rng, data)
    return data[:at] + rng.bytes(max(1, to - at)) + data[at:]


def delete(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Take a few bytes out."""
    at, to = _span(rng, data)
    return data[:at] + data[to:]


def repeat(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Repeat a piece: mostly once, sometimes thousands of times."""
    at, to = _span(rng, data)
    times = int(pick(rng, (1, 1, 1, 2, 3, 40, 3000)))
    return data[:to] + data[at:to] * times + data[to:]


def truncate(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Cut the end off."""
    return data[: int(rng.integers(0, len(data) + 1))]


def behead(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Cut the beginning off: a little of it."""
    return data[int(rng.integers(1, 9)) :]


def splice(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """The beginning of this, the end of another."""
    other = pick(rng, corpus.seeds)
    return data[: int(rng.integers(0, len(data) + 1))] + other[int(rng.integers(0, len(other) + 1)) :]


def swap(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Two pieces change places."""
    a, b = sorted((_span(rng, data), _span(rng, data)))
    b = (max(a[1], b[0]), max(a[1], b[1]))
    return data[: a[0]] + data[b[0] : b[1]] + data[a[1] : b[0]] + data[a[0] : a[1]] + data[b[1] :]


def whole(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Write a whole number that is often an edge, of 1, 2 or 4 bytes, in either order."""
    at = int(rng.integers(0, len(data) + 1))
    size = int(pick(rng, (1, 2, 4)))
    value = (int(pick(rng, WHOLE)) + int(rng.integers(-1, 2))) % (1 << 8 * size)
    return data[:at] + value.to_bytes(size, BIG_OR_LITTLE[int(rng.integers(0, 2))]) + data[at + size :]


def odd(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """Put something odd, or a word of the format, over or between."""
    at, to = _span(rng, data, 4)
    word = pick(rng, (*ODD, *corpus.words))
    return data[:at] + word + data[to if rng.integers(0, 2) else at :]


def _replaced(rng: Rng, data: bytes, form: re.Pattern[bytes], others: Sequence[bytes]) -> bytes:
    found = [m.span() for m in form.finditer(data[:20_000])]
    if not found or not others:
        return data
    at, to = found[int(rng.integers(0, len(found)))]
    return data[:at] + pick(rng, others) + data[to:]


def number(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Another number, or what looks like one."""
    return _replaced(rng, data, _NUMBER, NUMBERS)


def near(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """A number that differs by a little."""
    found = list(re.finditer(rb"[0-9]{1,9}", data[:20_000]))
    if not found:
        return data
    one = found[int(rng.integers(0, len(found)))]
    return data[: one.start()] + b"%d" % (int(one[0]) + int(rng.integers(-2, 3))) + data[one.end() :]


def word(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """Another word of the format."""
    return _replaced(rng, data, _TOKEN, corpus.words)


def misspell(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """A word with a letter too few, too many, or in capitals."""
    found = [m.span() for m in _TOKEN.finditer(data[:20_000])]
    if not found:
        return data
    at, to = found[int(rng.integers(0, len(found)))]
    k = int(rng.integers(at, to))
    new = pick(rng, (b"", data[k : k + 1] * 2, data[k : k + 1].swapcase(), b"x"))
    return data[:k] + new + data[k + 1 :]


def line(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """A line is lost, repeated, emptied, indented or swapped with the next; or all ends of lines change."""
    lines = data.split(b"\n")
    k = int(rng.integers(0, len(lines)))
    match int(rng.integers(0, 7)):
        case 0:
            del lines[k]
        case 1:
            lines[k:k] = [lines[k]] * int(pick(rng, (1, 1, 2, 500)))
        case 2:
            lines[k] = b""
        case 3:
            lines[k] = b"  " + lines[k]
        case 4:
            lines[k] = lines[k].lstrip()
        case 5:
            lines[k : k + 2] = lines[k : k + 2][::-1]
        case _:
            return pick(rng, (b"\r\n", b"\r", b"\n\n")).join(lines)
    return b"\n".join(lines)


def nest(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Brackets around a piece, or many that open."""
    at, to = _span(rng, data, 30)
    left, right = pick(rng, ((b"[", b"]"), (b"{", b"}"), (b"(", b")"), (b'"', b'"'), (b"- ", b"")))
    times = int(pick(rng, (1, 1, 2, 40, 2000)))
    return data[:at] + left * times + data[at:to] + right * int(pick(rng, (times, 1, 0))) + data[to:]


BYTE_CHANGES = (flip, put, insert, delete, repeat, truncate, behead, splice, swap, whole, odd)
TEXT_CHANGES = (number, number, near, word, misspell, line, line, nest, odd, splice)


def change_png(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A change inside the chunks of a PNG, its lengths and checksums right: of a chunk's kind or body, of the
    pixels before they are packed, of the order of chunks. Other files are changed as bytes.
    """
    if not data.startswith(b"\x89PNG") or len(data) < 20:
        return pick(rng, BYTE_CHANGES)(rng, data, corpus)
    chunks = _chunks(data)
    k = int(rng.integers(0, len(chunks)))
    kind, body = chunks[k]
    change = pick(rng, BYTE_CHANGES)
    way = rng.random()
    if way < 0.15:
        return change(rng, data, corpus)
    if way < 0.25:
        j = int(rng.integers(0, len(chunks)))
        chunks.insert(j, chunks[k])
    elif way < 0.3:
        del chunks[k]
    elif way < 0.4:
        chunks[k] = ((change(rng, kind, corpus) + b"IDAT")[:4], body)
    elif kind == b"IDAT" and way < 0.9:
        try:
            raw = zlib.decompressobj().decompress(body, MAX_BYTES)
        except zlib.error:
            raw = body
        chunks[k] = (kind, zlib.compress(change(rng, raw, Corpus((raw,), text=False))[:MAX_BYTES]))
    else:
        chunks[k] = (kind, change(rng, body, Corpus((body,), text=False))[:MAX_BYTES])
    return data[:8] + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )


def _chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    """Kinds and bodies, as far as the file goes."""
    chunks, at = [], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        length = min(length, len(data) - at - 12)
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    return chunks


def repair_npy(data: bytes) -> bytes:
    """The length of the header made right: it ends with the first end of line."""
    start, form = (10, "<H") if data[6:7] == b"\1" else (12, "<I")
    end = data.find(b"\n", start)
    if len(data) < start or end < 0:
        return data
    return data[:8] + struct.pack(form, (end + 1 - start) & 0xFFFF) + data[start:]
