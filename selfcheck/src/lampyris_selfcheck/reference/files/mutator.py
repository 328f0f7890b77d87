"""Mutated files from good ones: seeded, so that a case is known by its target, its seed and its number.

A mutant has one or two changes: of bytes, of lines, of words and numbers, or, where a file holds tables and lists, of
one branch of them. Where a checksum or a length stands before what was changed, it is made right again: a PNG is
changed chunk by chunk, pixels before they are packed.
"""

from __future__ import annotations

import json
import re
import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

import numpy as np
import yaml

Rng: TypeAlias = np.random.Generator
T = TypeVar("T")
Place: TypeAlias = tuple[str | int, ...]

MAX_BYTES = 200_000
NUMBERS = (
    *(
        b"0 -0 -1 1 00 +5 1.5 .5 1. 1e9 1e-400 1e999 -1e999 nan NaN .nan inf -inf .inf Infinity 0x10 0o17 010"
        b" 1_000 1,5 127 128 255 256 65535 65536 2147483647 2147483648 4294967295 4294967296 9007199254740993"
        b" 9223372036854775808 -9223372036854775809 18446744073709551616 true null 1:30 2026-01-01 =1+1"
    ).split(),
    *("\u0663 \uff11\uff12 \u00b2 \u22125".encode().split()),
    *(b"9" * n for n in (30, 310, 5000)),
    b"0." + b"3" * 400,
    b"1e" + b"9" * 30,
)
ODD = (
    *rb'" \ # % & * { } [ ] , : - | > ! ../ ""'.split(),
    *(bytes((b,)) for b in b"\0\r\n\t '\x7f\x0b\x0c\x1a\x1b\x80\xff"),
    *(b"\r\n", b"\x1b[31m", b"\xef\xbb\xbf", b"\xff\xfe", b"\xc3\x28", b"\xed\xa0\x80"),
    *(c.encode() for c in "\U0001f5fa\u2028\x85\u202e\u00e9"),
)
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 7, 0.0, -0.0, 0.5, -0.5, 1e-9, 1e9, 1e300, -1e300),
    *(255, 256, 2**16, 2**24, 2**24 + 1, 2**31, 2**63, 2**64, 10**31),
    *(float("nan"), float("inf"), float("-inf")),
    *("", " ", "a", "0", "-1", "1.5", "true", "null", "nan", "x" * 65, "x" * 5000),
    *("../m.map", "/etc/passwd", "m.map\0", "a\nb", "\x1b[31m", "\u202e", "\ud800", "caf\u00e9"),
    *(
        [],
        {},
        [0],
        [0, 0],
        [0, 0, 0],
        [-1, 0],
        [None],
        [[]],
        {"a": 1},
        {"": 0},
        {"m": [1, 1]},
        [[0, 0], [1, 1]],
    ),
)
"""What becomes of a branch of a tree."""
EDGES = (0, 1, 2, 3, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
_NUMBER = re.compile(rb"[-+]?[0-9][0-9.]*(?:[eE][-+]?[0-9]+)?")
_TOKEN = re.compile(rb"[A-Za-z_][A-Za-z0-9_-]*")
_DEEP = 40


@dataclass(frozen=True)
class Corpus:
    """What the mutants of one parser are made from.

    Parameters
    ----------
    seeds : good files.
    words : what the format's own words are, to be put where other words stand.
    text : whether lines, words and numbers mean something.
    change : a way of changing that knows the format, used half of the time.
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
        for _ in range(1 + int(rng.geometric(0.6) if rng.random() < 0.4 else 0)):
            known = self.change is not None and rng.random() < 0.5
            data = (self.change if known and self.change else any_change)(rng, data, self)[:MAX_BYTES]
        if self.repair is not None and rng.random() < 0.8:
            data = self.repair(data)
        return data


Change: TypeAlias = Callable[[Rng, bytes, Corpus], bytes]


def pick(rng: Rng, some: Sequence[T]) -> T:
    """One of them."""
    return some[int(rng.integers(0, len(some)))]


def any_change(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A change of a file of which no more is known than whether it is text."""
    return pick(rng, TEXT_CHANGES if corpus.text and rng.random() < 0.8 else BYTE_CHANGES)(rng, data, corpus)


# ---- bytes --------------------


def replaced(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """Some bytes, or none, become others, none, or something odd."""
    at = int(rng.integers(0, len(data) + 1))
    to = at + int(rng.integers(0, 8))
    new = pick(rng, (b"", rng.bytes(int(rng.integers(1, 8))), pick(rng, (*ODD, *corpus.words))))
    return data[:at] + new + data[to:]


def number_of_bytes(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """A bit turned, or a whole number of 1, 2 or 4 bytes that is an edge, or one more or one less than it was."""
    size, order = int(pick(rng, (1, 1, 2, 4))), "little" if rng.random() < 0.5 else "big"
    at = int(rng.integers(0, max(len(data) - size, 0) + 1))
    was = int.from_bytes(data[at : at + size], order)  # type: ignore[arg-type]
    new = pick(rng, (was + 1, was - 1, was ^ 1 << int(rng.integers(0, 8 * size)), pick(rng, EDGES), 0))
    return data[:at] + (new % (1 << 8 * size)).to_bytes(size, order) + data[at + size :]  # type: ignore[arg-type]


def repeated(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """A piece again: mostly once, sometimes thousands of times."""
    at = int(rng.integers(0, len(data) + 1))
    to = at + int(rng.integers(1, 13))
    return data[:to] + data[at:to] * int(pick(rng, (1, 1, 1, 2, 40, 3000))) + data[to:]


def cut(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """The end is lost, all of it or a few bytes; or a little of the beginning."""
    few = int(rng.integers(1, 9))
    return pick(rng, (data[: int(rng.integers(0, len(data) + 1))], data[:-few], data[few:]))


def spliced(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """The beginning of this, the end of another."""
    other = pick(rng, corpus.seeds)
    return data[: int(rng.integers(0, len(data) + 1))] + other[int(rng.integers(0, len(other) + 1)) :]


# ---- text --------------------


def _token(rng: Rng, data: bytes, form: re.Pattern[bytes], new: Callable[[bytes], bytes]) -> bytes:
    found = [m.span() for m in form.finditer(data[:20_000])]
    if not found:
        return data
    at, to = pick(rng, found)
    return data[:at] + new(data[at:to]) + data[to:]


def number(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Another number, or what looks like one."""
    return _token(rng, data, _NUMBER, lambda was: pick(rng, NUMBERS))


def near(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """A number that differs by a little, or is 0."""
    by = int(rng.integers(-2, 3))
    return _token(rng, data, re.compile(rb"[0-9]{1,9}"), lambda was: b"%d" % (int(was) + by if by else 0))


def word(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """Another word of the format, or one with a letter too few, too many, or in capitals."""

    def new(was: bytes) -> bytes:
        k = int(rng.integers(0, len(was)))
        changed = pick(rng, (b"", was[k : k + 1] * 2, was[k : k + 1].swapcase(), b"x"))
        misspelt = was[:k] + changed + was[k + 1 :]
        return pick(rng, corpus.words) if corpus.words and rng.random() < 0.6 else misspelt

    return _token(rng, data, _TOKEN, new)


def line(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """A line is lost, repeated, emptied, longer, shorter, moved or joined to the next; or all ends of lines change."""
    lines = data.split(b"\n")
    k = int(rng.integers(0, len(lines)))
    here = lines[k]
    new: tuple[list[bytes], ...] = (
        [],
        [here] * int(pick(rng, (2, 2, 3, 500))),
        [b""],
        [b"  " + here],
        [here.lstrip()],
        [here[:-1]],
        [here + here[-1:]],
    )
    way = int(rng.integers(0, len(new) + 3))
    if way < len(new):
        return b"\n".join((*lines[:k], *new[way], *lines[k + 1 :]))
    if way == len(new):
        return b"\n".join((*lines[:k], *lines[k : k + 2][::-1], *lines[k + 2 :]))
    if way == len(new) + 1:
        joined = pick(rng, (b"", b".", b"#", b"@", b",")).join(lines[k : k + 2])
        return b"\n".join((*lines[:k], joined, *lines[k + 2 :]))
    return pick(rng, (b"\r\n", b"\r", b"\n\n")).join(lines)


def nested(rng: Rng, data: bytes, _: Corpus) -> bytes:
    """Brackets around a piece, or many that open."""
    at = int(rng.integers(0, len(data) + 1))
    to = at + int(rng.integers(1, 30))
    left, right = pick(rng, ((b"[", b"]"), (b"{", b"}"), (b"(", b")"), (b'"', b'"'), (b"- ", b"")))
    times = int(pick(rng, (1, 1, 2, 40, 2000)))
    return data[:at] + left * times + data[at:to] + right * int(pick(rng, (times, 1, 0))) + data[to:]


BYTE_CHANGES: tuple[Change, ...] = (replaced, number_of_bytes, number_of_bytes, repeated, cut, spliced)
TEXT_CHANGES: tuple[Change, ...] = (number, number, near, word, word, line, line, nested, replaced, spliced)


# ---- formats --------------------


def change_rows(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A MovingAI map with a height or width of 0 or off by one, and as often as not with the rows to it."""
    lines = data.split(b"\n")
    if not data.startswith(b"type") or len(lines) < 5 or rng.random() < 0.5:
        return line(rng, data, corpus)
    what = int(rng.integers(1, 3))
    size = max(0, pick(rng, (0, len(lines) - 5 if what == 1 else len(lines[4]))) + int(rng.integers(-1, 2)))
    lines[what] = lines[what].split(b" ")[0] + b" %d" % size
    if rng.random() < 0.5:
        rows = lines[4 : 4 + size] if what == 1 else [row[:size].ljust(size, b".") for row in lines[4:-1]]
        lines[4:] = [*rows, b""]
    return b"\n".join(lines)


def change_bmp(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A BMP of whose pixels or run lengths one byte is off by one."""
    if len(data) < 40:
        return any_change(rng, data, corpus)
    raster = min(struct.unpack_from("<I", data, 10)[0], len(data) - 1)
    at = int(rng.integers(raster, len(data)))
    return data[:at] + bytes(((data[at] + pick(rng, (-1, 1))) % 256,)) + data[at + 1 :]


def change_png(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A PNG with a chunk lost, given twice or changed, its lengths and checksums right."""
    if not data.startswith(b"\x89PNG") or len(data) < 20:
        return any_change(rng, data, corpus)
    chunks = list(_chunks(data))
    k = int(rng.integers(0, len(chunks)))
    kind, body = chunks[k]
    change = pick(rng, BYTE_CHANGES)
    way = rng.random()
    if way < 0.1:
        chunks.insert(int(rng.integers(0, len(chunks))), chunks[k])
    elif way < 0.15:
        del chunks[k]
    elif way < 0.25:
        chunks[k] = ((change(rng, kind, corpus) + b"IDAT")[:4], body)
    elif kind == b"IDAT":
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


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kinds and bodies, as far as the file goes."""
    at = 8
    while at + 12 <= len(data):
        length = min(struct.unpack_from(">I", data, at)[0], len(data) - at - 12)
        yield data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        at += 12 + length


def change_npy(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A NumPy file of another version, or of a byte more or fewer."""
    if rng.random() < 0.5:
        return data[:6] + bytes((int(pick(rng, (0, 1, 2, 3, 4, 255))),)) + data[7:]
    return data[:-1] if rng.random() < 0.5 else data + b"\0"


def repair_npy(data: bytes) -> bytes:
    """The length of the header made right: it ends with the first end of line."""
    end = data.find(b"\n", 12)
    if len(data) < 12 or end < 0:
        return data
    if data[6] == 1:
        return data[:8] + struct.pack("<H", (end - 9) & 0xFFFF) + data[10:]
    # Of a file that was of version 1 the length takes two bytes more now.
    start = 10 if data[10:11] == b"{" else 12
    return data[:8] + struct.pack("<I", end + 1 - start) + data[start:]


def change_tree(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """A file of tables and lists with one branch other than it was, written anew, as JSON or as YAML."""
    tree = _tree(data)
    if tree is None:
        return any_change(rng, data, corpus)
    places = list(_places(tree))
    place = pick(rng, places)
    here = _at(tree, place)
    other = _tree(pick(rng, corpus.seeds))
    elsewhere = tree if other is None else other
    whole = isinstance(here, int | float) and not isinstance(here, bool)
    new: list[Any] = [
        pick(rng, VALUES),
        pick(rng, VALUES),
        here + int(rng.integers(-2, 3)) if whole else _children_changed(rng, here, corpus),
        _children_changed(rng, here, corpus),
        _at(elsewhere, pick(rng, list(_places(elsewhere)))),
    ]
    tree = _put(tree, place, pick(rng, new))
    if data.lstrip()[:1] in (b"{", b"[") or rng.random() < 0.3:
        text = json.dumps(tree, ensure_ascii=rng.random() < 0.5, indent=pick(rng, (None, 0, 2)))
    else:
        text = yaml.safe_dump(tree, allow_unicode=True, sort_keys=False)
    return text.encode("utf-8", "surrogatepass")


def _tree(data: bytes) -> Any:
    """What JSON or YAML says; None where it is neither, or a single value."""
    if len(data) > 20_000:
        return None
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError):
        try:
            tree = json.loads(json.dumps(yaml.safe_load(data.removesuffix(b"---\n")), default=str))
        except (yaml.YAMLError, ValueError, TypeError, LookupError, RecursionError):
            return None
    return tree if isinstance(tree, dict | list) else None


def _children_changed(rng: Rng, here: Any, corpus: Corpus) -> Any:
    """A table or list with a child lost, named anew, given twice or many times, or one more."""
    new = pick(rng, corpus.words or (b"x",)).decode("utf-8", "replace")
    if isinstance(here, list):
        k = int(rng.integers(0, len(here) + 1))
        inner = here[k : k + 1] or [pick(rng, VALUES)]
        return here[:k] + inner * int(pick(rng, (0, 1, 2, 30, 1001))) + here[k + 1 :]
    if not isinstance(here, dict):
        return new
    if not here or rng.random() < 0.3:
        return {**here, new: pick(rng, VALUES)}
    key = pick(rng, list(here))
    name = pick(rng, (None, new, key[:-1]))
    return {(name if k == key else k): v for k, v in here.items() if k != key or name is not None}


def _places(tree: Any, place: Place = ()) -> Iterator[Place]:
    """The place of every branch, the tree itself first."""
    yield place
    if len(place) < _DEEP and isinstance(tree, dict | list):
        for key, inner in tree.items() if isinstance(tree, dict) else enumerate(tree[:50]):
            yield from _places(inner, (*place, key))


def _at(tree: Any, place: Place) -> Any:
    for step in place:
        tree = tree[step]
    return tree


def _put(tree: Any, place: Place, value: Any) -> Any:
    """A copy with another value there."""
    if not place:
        return value
    step = place[0]
    inner = _put(tree[step], place[1:], value)
    if isinstance(tree, list):
        return [inner if k == step else old for k, old in enumerate(tree)]
    return {key: inner if key == step else old for key, old in tree.items()}
