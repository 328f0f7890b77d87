"""The strict YAML reader: what values mean, where they stand, what is refused."""

from __future__ import annotations

import math

import pytest
import yaml

from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.text.strict_yaml import MAX_BYTES, read_yaml


def value(text: str) -> object:
    return read_yaml(f"a: {text}\n", "f").data["a"]


@pytest.mark.parametrize(
    ("text", "means"),
    [
        ("5e-2", 0.05), ("1e3", 1000.0), ("-.5", -0.5), ("1.", 1.0), ("+1.5E+1", 15.0), ("0", 0), ("-0", 0),
        ("12", 12), ("+3", 3), ("0x1F", 31), ("0o17", 15), ("00.5", 0.5),
        (".inf", math.inf), ("-.INF", -math.inf),
        ("true", True), ("False", False), ("~", None), ("null", None), ("", None),
        # Text, where YAML 1.1 has numbers, booleans, dates and merges.
        ("no", "no"), ("yes", "yes"), ("on", "on"), ("y", "y"), ("1:30", "1:30"), ("1_000", "1_000"),
        ("0b11", "0b11"), ("2025-04-24", "2025-04-24"), ("tRUE", "tRUE"), ("1e", "1e"),
        ("+", "+"), (".", "."),
        ("inf", "inf"), ("nan", "nan"), ("-.nan", "-.nan"),
        ("'1'", "1"), ('"true"', "true"), ("''", ""), ("|\n  010\n", "010\n"), (">-\n  5\n", "5"),
        (r'"\ud83d\uddfa"', "\U0001f5fa"), (r'"\x41\/"', "A/"),
        ("[1, [2.5, x], {b: no}]", [1, [2.5, "x"], {"b": "no"}]),
    ],
)  # fmt: skip
def test_values_follow_yaml_1_2(text: str, means: object) -> None:
    found = value(text)
    assert found == means
    assert type(found) is type(means)


def test_nan() -> None:
    found = value(".nan")
    assert isinstance(found, float)
    assert math.isnan(found)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("010", "YAML_NUMBER"), ("-007", "YAML_NUMBER"), ("00", "YAML_NUMBER"), ("1e999", "YAML_NUMBER"),
        ("9" * 31, "YAML_NUMBER"), ("0x" + "f" * 40, "YAML_NUMBER"), ("-1e400", "YAML_NUMBER"),
        (r'"\ud800"', "YAML_SYNTAX"), (r'"\U00110000"', "YAML_SYNTAX"), (r'"\UFFFFFFFF"', "YAML_SYNTAX"),
        ("{b: 1, b: 2}", "YAML_DUPLICATE"), ("{b: 1, 'b': 2}", "YAML_DUPLICATE"), ("{[1]: 2}", "YAML_SHAPE"),
        ("{'': 2}", "YAML_SHAPE"), ("&x 1", "YAML_ALIAS"), ("*x", "YAML_ALIAS"), ("!!str 1", "YAML_TAG"),
        ("! 1", "YAML_TAG"), ("!local 1", "YAML_TAG"), ("!h!x 1", "YAML_TAG"), ("[", "YAML_SYNTAX"),
        ("b: c", "YAML_SYNTAX"), ("\x07", "YAML_SYNTAX"), ("\ud800", "YAML_SYNTAX"), ("\x7f", "YAML_SYNTAX"),
    ],
)  # fmt: skip
def test_refused_at_its_place(text: str, code: str) -> None:
    with pytest.raises(FileError) as caught:
        value(text)
    assert caught.value.code == code
    assert caught.value.where.startswith(("f:1:", "f:2:"))


def test_keys_are_words_as_they_were_written() -> None:
    assert read_yaml("1: a\nno: b\n'x y': c\n<<: d\n", "f").data == {
        "1": "a",
        "no": "b",
        "x y": "c",
        "<<": "d",
    }


def test_every_value_has_its_place() -> None:
    found = read_yaml(b"\xef\xbb\xbf# first\nmap:\n  size: [3,\n    4]\nx: 1\n", "f.yaml")
    assert found.at() == "f.yaml:2:1"
    assert found.at("map") == "f.yaml:3:3"
    assert found.at("map", "size", 1) == "f.yaml:4:5"
    assert found.at_key("map", "size") == "f.yaml:3:3"
    assert found.at("map", "missing", 3) == "f.yaml:3:3", "what it should be in"
    problem = found.error("CODE", "wrong", "x", allowed="right")
    assert str(problem) == "error[CODE]: f.yaml:5:4: wrong; allowed: right"


def test_one_document_may_be_marked() -> None:
    assert read_yaml("%YAML 1.1\n---\na: no\n...\n", "f").data == {"a": "no"}
    for text in ("a: 1\n---\n", "a: 1\n--- \nb: 1\n", "---\na: 1\n---\n"):
        with pytest.raises(FileError, match=r"YAML_SHAPE.*second document"):
            read_yaml(text, "f")


def test_limits_hold_at_their_edges() -> None:
    fill = "a: '" + "x" * (MAX_BYTES - 6) + "'\n"
    assert len(read_yaml(fill, "f").data["a"]) == MAX_BYTES - 6
    with pytest.raises(LimitError, match="YAML_SIZE"):
        read_yaml(fill + "\n", "f")
    with pytest.raises(LimitError, match="YAML_SIZE"):
        read_yaml("a: ü\n", "f", max_bytes=5)
    assert read_yaml("a: " + "[" * 31 + "]" * 31, "f").data
    with pytest.raises(LimitError, match="YAML_DEPTH"):
        read_yaml("a: " + "[" * 32 + "]" * 32, "f")
    assert read_yaml("a: [1, 2]", "f", max_values=4).data == {"a": [1, 2]}
    with pytest.raises(LimitError, match=r"YAML_SIZE.*too many values; allowed: at most 3"):
        read_yaml("a: [1, 2]", "f", max_values=3)


@pytest.mark.parametrize(
    ("before", "levels"),
    [("", 0), ("a: ", 1), ("a:\n  b:\n    c: ", 3), ("a:\n  - - b: ", 4)],
)
def test_the_bracket_that_is_too_deep_is_named(before: str, levels: int) -> None:
    """Whether blocks or brackets nest, and even if what is open is never closed."""
    line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
    inner = [("[", "]"), ('{"a":', "}")] * 20 if levels else [('{"a":', "}"), ("[", "]")] * 20
    for many in (32 - levels, 33 - levels):
        opened, closed = inner[:many], reversed(inner[:many])
        text = before + "".join(a for a, _ in opened) + "0" + "".join(b for _, b in closed)
        if many + levels <= 32:
            assert read_yaml(text, "f").data
            continue
        place = column + sum(len(a) for a, _ in opened[:-1])
        for end in ("".join(b for _, b in reversed(opened)), "", "[" * 3000, "]]}", " 0" * 500):
            with pytest.raises(LimitError, match=f"YAML_DEPTH.*f:{line}:{place}: nested too deep"):
                read_yaml(before + "".join(a for a, _ in opened) + end, "f")


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("{image: m.pgm, res" + "[" * 2000, "YAML_SYNTAX"),
        ("a: " + "{" * 2000, "YAML_SHAPE"),
        ("a: " + '{"a":' * 900, "YAML_DEPTH"),
        ("a: [" + "\n[" * 2000, "YAML_DEPTH"),
    ],
)
def test_few_brackets_may_begin_a_key(text: str, code: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """PyYAML looks at all such for each token: of a thousand in one line that were a million looks."""
    looks: list[int] = []
    real = yaml.SafeLoader.stale_possible_simple_keys

    def counted(self: yaml.SafeLoader) -> None:
        looks.append(len(self.possible_simple_keys))
        real(self)

    monkeypatch.setattr(yaml.SafeLoader, "stale_possible_simple_keys", counted)
    with pytest.raises(LampyrisError, match=code):
        read_yaml(text, "f")
    assert max(looks) <= 33
    assert len(looks) < 4200


def test_tabs_are_told_to_be_spaces() -> None:
    with pytest.raises(
        FileError, match=r"^error\[YAML_SYNTAX\]: a.yaml:2:1: .*; write spaces instead of tabs$"
    ):
        read_yaml("a: 1\n\tb: 2\n", "a.yaml")
