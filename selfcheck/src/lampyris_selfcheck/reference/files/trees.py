"""Mutants of files that hold a tree of tables, lists and values: the tree is changed, and written anew.

What is written is well formed, so it is not the syntax but what is said that is wrong: a value of another
type or out of its range, a key too many, too few or of another table, a branch of another file. It is written
in any of the styles that the format has.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any, TypeAlias

import yaml

from lampyris_selfcheck.reference.files.mutator import BYTE_CHANGES, TEXT_CHANGES, Corpus, Rng, pick

Way: TypeAlias = tuple[str | int, ...]

ODD_VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 7, 0.0, -0.0, 0.5, 1.0, -0.5, 1e-9, 1e9, 1e300, -1e300),
    *(255, 256, 2**16, 2**24, 2**24 + 1, 2**31 - 1, 2**31, 2**63 - 1, 2**63, 2**64, 10**29, 10**31),
    *(float("nan"), float("inf"), float("-inf")),
    *("", " ", "a", "0", "1", "-1", "1.5", "true", "null", "nan", "x" * 64, "x" * 65, "x" * 5000),
    *(
        "../m.map",
        "/etc/passwd",
        "m.map\0",
        "a\nb",
        "\x1b[31m",
        "\u202e",
        "\ud800",
        "caf\u00e9",
        "\U0001f5fa",
    ),
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
EDGES = (0, 0.0, float("nan"), float("inf"), float("-inf"))
"""What becomes of a number, besides one more and one less."""
_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_./-]*")
_DEEP = 40


def change_json(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """The tree of a JSON file changed, or, as often, its text."""
    return _changed(rng, data, corpus, _json)


def change_yaml(rng: Rng, data: bytes, corpus: Corpus) -> bytes:
    """The tree of a YAML file changed, or, as often, its text."""
    return _changed(rng, data, corpus, _json_or_yaml)


def _changed(rng: Rng, data: bytes, corpus: Corpus, written: Callable[[Rng, Any], str]) -> bytes:
    tree = _tree(data, corpus) if len(data) < 20_000 and rng.random() < 0.6 else None
    if tree is None:
        return pick(rng, TEXT_CHANGES if rng.random() < 0.8 else BYTE_CHANGES)(rng, data, corpus)
    return written(rng, changed_tree(rng, tree, corpus)).encode("utf-8", "surrogatepass")


def changed_tree(rng: Rng, tree: Any, corpus: Corpus) -> Any:
    """The tree with one branch other than it was; the tree given stays as it is."""
    ways = list(_ways(tree))
    way = pick(rng, ways)
    here = _at(tree, way)
    roll = rng.random()
    if roll < 0.35:
        return _set(tree, way, pick(rng, ODD_VALUES))
    if roll < 0.5 and _is_number(here):
        return _set(tree, way, here + int(rng.integers(-2, 3)))
    if roll < 0.6:
        return _set(tree, way, _at(tree, pick(rng, ways)))
    if roll < 0.68 and (numbers := [w for w in ways if _is_number(_at(tree, w))]):
        way = pick(rng, numbers)
        return _set(tree, way, pick(rng, (*EDGES, _at(tree, way) - 1, _at(tree, way) + 1)))
    if roll < 0.75:
        other = _tree(pick(rng, corpus.seeds), corpus) or tree
        return _set(tree, way, _at(other, pick(rng, list(_ways(other)))))
    return _children_changed(rng, tree, way, here, corpus)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _children_changed(rng: Rng, tree: Any, way: Way, here: Any, corpus: Corpus) -> Any:
    """A table or list with a child lost, named anew, given twice, or one more."""
    while not isinstance(here, dict | list) and way:
        way = way[:-1]
        here = _at(tree, way)
    if not isinstance(here, dict | list):
        return pick(rng, ODD_VALUES)
    word = pick(rng, corpus.words or (b"x",)).decode("utf-8", "replace")
    if isinstance(here, list):
        k = int(rng.integers(0, len(here) + 1))
        times = int(pick(rng, (0, 1, 2, 30, 1001)))
        inner = here[k : k + 1] or [pick(rng, ODD_VALUES)]
        return _set(tree, way, here[:k] + inner * times + here[k + 1 :])
    if not here or rng.random() < 0.3:
        return _set(tree, way, {**here, word: pick(rng, ODD_VALUES)})
    key = pick(rng, list(here))
    if rng.random() < 0.5:
        return _set(tree, way, {name: value for name, value in here.items() if name != key})
    new = word if rng.random() < 0.5 else key[:-1]
    return _set(tree, way, {new if name == key else name: value for name, value in here.items()})


@lru_cache(maxsize=256)
def _seed(data: bytes) -> str | None:
    """The tree of a good file as JSON; None where it is not JSON, nor YAML as both its versions read it."""
    tree = _json_of(data)
    if tree is None:
        try:
            tree = yaml.safe_load(data.removesuffix(b"---\n"))  # so `ros2 topic echo` ends a message
        except (yaml.YAMLError, ValueError):
            return None
    return json.dumps(tree, default=str) if isinstance(tree, dict | list) else None


def _tree(data: bytes, corpus: Corpus) -> Any:
    """A good file's tree; another file's where it is JSON: what was changed already mostly is."""
    if data not in corpus.seeds:
        return _json_of(data)
    text = _seed(data)
    return None if text is None else json.loads(text)


def _json_of(data: bytes) -> Any:
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError):
        return None
    return tree if isinstance(tree, dict | list) else None


def _ways(tree: Any, way: Way = ()) -> list[Way]:
    """The way to every branch, the tree itself first."""
    found = [way]
    if isinstance(tree, dict) and len(way) < _DEEP:
        for key, inner in tree.items():
            found += _ways(inner, (*way, key))
    elif isinstance(tree, list) and len(way) < _DEEP:
        for k, inner in enumerate(tree[:50]):
            found += _ways(inner, (*way, k))
    return found


def _at(tree: Any, way: Way) -> Any:
    for step in way:
        tree = tree[step]
    return tree


def _set(tree: Any, way: Way, value: Any) -> Any:
    """A copy with another value there."""
    if not way:
        return value
    step, *rest = way
    inner = _set(tree[step], tuple(rest), value)
    if isinstance(step, int):
        return [*tree[:step], inner, *tree[step + 1 :]]
    return {key: inner if key == step else old for key, old in tree.items()}


def _json(rng: Rng, tree: Any) -> str:
    return json.dumps(
        tree,
        ensure_ascii=bool(rng.integers(0, 2)),
        indent=pick(rng, (None, 0, 2)),
        separators=pick(rng, ((",", ":"), (", ", ": "))),
    )


def _json_or_yaml(rng: Rng, tree: Any) -> str:
    return _json(rng, tree) if rng.random() < 0.2 else _block(rng, tree, 0) + "\n"


def _block(rng: Rng, tree: Any, depth: int) -> str:
    """YAML in blocks, and in flow where there is nothing within, or by chance."""
    if not isinstance(tree, dict | list) or not tree or depth > 6 or rng.random() < 0.3 * (depth > 0):
        return _flow(rng, tree)
    pad = "\n" + "  " * depth
    if isinstance(tree, list):
        return pad + pad.join(f"- {_block(rng, inner, depth + 1)}" for inner in tree)
    lines = pad.join(f"{_flow(rng, key)}: {_block(rng, inner, depth + 1)}" for key, inner in tree.items())
    return lines if not depth else pad + lines


def _flow(rng: Rng, tree: Any) -> str:
    if isinstance(tree, dict):
        return "{" + ", ".join(f"{_flow(rng, k)}: {_flow(rng, v)}" for k, v in tree.items()) + "}"
    if isinstance(tree, list):
        return "[" + ", ".join(_flow(rng, inner) for inner in tree) + "]"
    if isinstance(tree, str) and _PLAIN.fullmatch(tree) and rng.random() < 0.7:
        return tree
    if isinstance(tree, str) and tree.isprintable() and "'" not in tree and rng.random() < 0.4:
        return f"'{tree}'"
    if isinstance(tree, float) and tree - tree != 0:
        return ".nan" if tree != tree else ".inf" if tree > 0 else "-.inf"
    return json.dumps(tree)
