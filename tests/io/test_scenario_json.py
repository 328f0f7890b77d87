"""The strict JSON reader: what it takes equals what Python's takes, and every mistake has its place."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.text import strict_json
from lampyris.io.text.strict_json import JsonDocument, pointer, read_json


def some_value(rng: np.random.Generator, depth: int = 0) -> Any:
    """A random JSON value."""
    kind = int(rng.integers(8 if depth < 4 else 5))
    if kind == 0:
        return [None, True, False][int(rng.integers(3))]
    if kind == 1:
        return int(rng.integers(-(10**12), 10**12))
    if kind == 2:
        return float(rng.normal() * 10.0 ** int(rng.integers(-20, 20)))
    if kind < 5:
        letters = ["a", "Z", " ", '"', "\\", "/", "é", "\u2028", "😀", "{", "]", ":"]
        return "".join(letters[int(k)] for k in rng.integers(len(letters), size=rng.integers(6)))
    items = [some_value(rng, depth + 1) for _ in range(int(rng.integers(4)))]
    return items if kind == 5 else {f"k{n}": item for n, item in enumerate(items)}


def every_way(value: Any, way: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [way, *(w for key, item in items for w in every_way(item, (*way, key)))]


def at_position(text: str, place: tuple[int, int]) -> str:
    """The text from a line and column on."""
    lines = text.split("\n")
    return "\n".join([lines[place[0] - 1][place[1] - 1 :], *lines[place[0] :]])


def test_it_reads_what_python_reads_and_knows_every_place() -> None:
    rng = np.random.default_rng(7)
    ways = 0
    for k in range(300):
        data = {"a": some_value(rng), "b": some_value(rng)}
        text = json.dumps(data, ensure_ascii=k % 2 == 0, indent=[None, 1][k % 3 == 0])
        document = read_json(text.encode(), "x.json")
        assert document.data == data
        assert repr(document.data) == repr(json.loads(text))  # True is not 1, and 1.0 is not 1
        for way in every_way(data):
            value: Any = data
            for step in way:
                value = value[step]
            rest = at_position(text, document.place(*way))
            assert json.JSONDecoder().raw_decode(rest)[0] == value, way
            if way and isinstance(way[-1], str):
                line, column = map(int, document.at_key(*way).split(":")[1:])
                assert at_position(text, (line, column)).startswith(f'"{way[-1]}"')
            ways += 1
    assert ways > 1500


def test_a_place_that_is_not_there_is_that_of_what_it_should_be_in() -> None:
    document = read_json(b'{"a": {"b": [1, 2]},\n "c": 3}', "x.json")
    assert document.at("a", "b", 7) == "x.json:1:13"
    assert document.at("a", "z", "y") == "x.json:1:7"
    assert document.at("c", "d") == "x.json:2:7"
    assert document.at() == "x.json:1:1"
    assert pointer(("a/b", 3, "~")) == "/a~1b/3/~0"


@pytest.mark.parametrize(
    ("text", "code", "place", "says"),
    [
        ("", "JSON_SHAPE", "1:1", "empty"),
        ("[1]", "JSON_SHAPE", "1:1", "a list"),
        ('"x"', "JSON_SHAPE", "1:1", "one object"),
        ('{\n "a": 1,\n}', "JSON_SYNTAX", "2:8", "a comma before }"),
        ('{"a": [1,\n2,]}', "JSON_SYNTAX", "2:2: /a/2", "a comma before ]"),
        ('{"a": 1 // no\n}', "JSON_SYNTAX", "1:9", "no comments"),
        ('{"a": 1 /* no */}', "JSON_SYNTAX", "1:9", "no comments"),
        ('{"a": {"b":', "JSON_SYNTAX", "1:12: /a/b", "too early"),
        ('{"a": [1, 2', "JSON_SYNTAX", "1:12", "too early"),
        ('{"a": "x', "JSON_SYNTAX", "1:7", 'closing "'),
        ('{"a": "\\q"}', "JSON_SYNTAX", "1:8", "escape"),
        ('{"a": "\\u12"}', "JSON_SYNTAX", "1:9", "escape"),
        ('{"a" 1}', "JSON_SYNTAX", "1:6: /a", "expected :"),
        ("{a: 1}", "JSON_SYNTAX", "1:2", "a key"),
        ("{'a': 1}", "JSON_SYNTAX", "1:2", "a key"),
        ('{"a": 01}', "JSON_SYNTAX", "1:8: /a", "leading zeros"),
        ('{"a": .5}', "JSON_SYNTAX", "1:7", "a value"),
        ('{"a": +1}', "JSON_SYNTAX", "1:7", "a value"),
        ('{"a": 5m}', "JSON_SYNTAX", "1:8", "no unit"),
        ('{"a": tru}', "JSON_SYNTAX", "1:7", "a value"),
        ('{"a": 1}\n{}', "JSON_SYNTAX", "2:1", "the end of the file"),
        ('{"r": {"v": NaN}}', "JSON_NUMBER", "1:13: /r/v", "not finite"),
        ('{"r": {"v": -Infinity}}', "JSON_NUMBER", "1:13: /r/v", "not finite"),
        ('{"r": {"v": 1e999}}', "JSON_NUMBER", "1:13: /r/v", "not finite"),
        ('{"r": ' + "7" * 5000 + "}", "JSON_NUMBER", "1:7: /r", "5,000 digits"),
        ('{"r": {"v": 1,\n "w": [[]],\n "v": 2}}', "JSON_DUPLICATE", "3:2: /r/v", "lines 1 and 3"),
        ('{"\\u0061": 1, "a": 2}', "JSON_DUPLICATE", "1:15: /a", "'a'"),
        ('{"a": "\\ud800"}', "JSON_TEXT", "1:7: /a", "U+D800"),
        ('{"a": "x\\u0007"}', "JSON_TEXT", "1:7: /a", "U+0007"),
        ('{"a": "x\ny"}', "JSON_TEXT", "1:7: /a", "U+000A"),
        ('{"\\u0000": 1}', "JSON_TEXT", "1:2", "U+0000"),
    ],
)
def test_each_mistake(text: str, code: str, place: str, says: str) -> None:
    with pytest.raises(FileError) as caught:
        read_json(text.encode("utf-8", "surrogatepass"), "x.json")
    error = caught.value
    assert error.code == code
    assert f"{error.where}: ".startswith(f"x.json:{place}: "), error
    assert says in str(error)
    assert len(str(error)) < 300
    assert str(error).isprintable()


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b'{"a": ' + b"[" * 100_000, "JSON_DEPTH"),
        (b'{"a": ' + b'{"a": ' * 100_000, "JSON_DEPTH"),
        (b" " * (2**24 + 1), "JSON_SIZE"),
        (b'{"a": [' + b"1," * 600_000 + b"1]}", "JSON_SIZE"),
    ],
)
def test_limits(data: bytes, code: str) -> None:
    with pytest.raises(LimitError) as caught:
        read_json(data, "x.json")
    assert (caught.value.code, caught.value.exit_code) == (code, 5)


def test_each_limit_at_its_number() -> None:
    def deep(n: int) -> bytes:
        return b'{"a":' + b"[" * (n - 1) + b"]" * (n - 1) + b"}"

    read_json(deep(32), "x.json")
    with pytest.raises(LimitError, match="JSON_DEPTH"):
        read_json(deep(33), "x.json")
    read_json(b'{"a":[1,1]}', "x.json", max_values=3)
    with pytest.raises(LimitError, match="JSON_SIZE"):
        read_json(b'{"a":[1,1]}', "x.json", max_values=2)
    with pytest.raises(FileError, match="31 digits"):
        read_json(b'{"a":' + b"1" * 31 + b"}", "x.json")
    assert read_json(b'{"a":-' + b"1" * 30 + b"}", "x.json").data == {"a": -int("1" * 30)}


def test_a_byte_order_mark_is_taken_and_other_encodings_are_not() -> None:
    assert read_json(b'\xef\xbb\xbf{"a": 1}', "x.json").data == {"a": 1}
    with pytest.raises(FileError, match="UTF-16"):
        read_json('{"a": 1}'.encode("utf-16"), "x.json")
    with pytest.raises(FileError, match=r"x\.json:2:3: byte 0xe9"):
        read_json(b'{"a":\n "\xe9"}', "x.json")


def test_damaged_texts_give_a_document_or_a_typed_error() -> None:
    rng = np.random.default_rng(3)
    good = json.dumps(
        {"version": 1, "map": {"rows": ["..", "é#"]}, "n": [1, -2.5e3, True, None], "s": "a\\n"}
    )
    read = refused = 0
    for _ in range(3000):
        raw = bytearray(good.encode())
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(raw)))
            word = [b"", b'"', b"{", b"]", b",", b"\\", b"9", b"\x00", b"\xff", b"nul", b"1e9"][
                int(rng.integers(11))
            ]
            raw[at : at + int(rng.integers(3))] = word
        try:
            document = read_json(bytes(raw), "x.json")
        except LampyrisError as error:
            refused += error.code.startswith("JSON_")
        else:
            assert isinstance(document, JsonDocument)
            assert document.data == json.loads(bytes(raw))
            read += 1
    assert read + refused == 3000
    assert read > 300
    assert refused > 1000


def test_places_of_thousands_of_mistakes_are_found_in_one_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each table and list is gone through once, however many of its parts are asked for."""
    began: list[int] = []
    parts = strict_json._parts

    def counted(text: str, at: int) -> object:
        began.append(at)
        return parts(text, at)

    monkeypatch.setattr(strict_json, "_parts", counted)
    items = ",\n".join(f'{{"b": [{k}, 7]}}' for k in range(500))
    found = read_json(f'{{"x": 0, "a": [{items}]}}'.encode(), "f")
    for k in (499, 0, 250, 499):
        assert found.place("a", k) == (k + 1, 16 if k == 0 else 1)
        assert found.place("a", k, "b", 1) == (k + 1, (16 if k == 0 else 1) + 9 + len(str(k)))
    assert found.at("a", 500, "b") == found.at("a") == "f:1:15"
    assert found.at("a", "0") == found.at("a", -1) == found.at("a")
    assert found.at_key("a", 3, "b") == "f:4:2"
    assert found.at("x", "y") == "f:1:7"
    assert len(began) == len(set(began)) == 2 + 2 * 3 + 1
