"""Data classes that are made quickly behave as those of the standard library."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
import typing
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest

from lampyris._core import records

HOW: tuple[dict[str, bool], ...] = (
    {"frozen": True, "slots": True},
    {"frozen": True},
    {"frozen": True, "slots": True, "eq": False},
    {"frozen": True, "slots": True, "repr": False},
    {"frozen": True, "slots": True, "kw_only": True},
    {"frozen": True, "slots": True, "order": True},
    {"slots": True},
    {},
)


standard: Callable[..., Any] = dataclasses.dataclass


def classes(make: Callable[..., Any], how: dict[str, bool]) -> SimpleNamespace:
    @make(**how)
    class Plain:
        """Values with and without defaults."""

        a: int
        b: float = 0.5
        c: list[int] = dataclasses.field(default_factory=list, compare=False)
        d: str = dataclasses.field(default="x", repr=False)
        kind: ClassVar[str] = "plain"

    @make(**how)
    class Checked:
        """Fields that are not given, and a check."""

        a: int
        b: int = dataclasses.field(init=False, default=3)
        c: list[int] = dataclasses.field(init=False, default_factory=list)
        d: int = dataclasses.field(default=4, kw_only=True)

        def __post_init__(self) -> None:
            if self.a < 0:
                raise ValueError("a")

    @make(**how)
    class Empty:
        """Nothing."""

    @make(**how)
    class Own:
        """Methods of its own."""

        a: int = 1

        def __repr__(self) -> str:
            return "own"

        def __getstate__(self) -> int:
            return 7

    @standard(frozen=how.get("frozen", False))
    class Heir(Plain):
        """Derived by the standard library's."""

        e: int = dataclasses.field(default=9, kw_only=True)

    @make(**how)
    class Second(Plain):
        """Derived by the same."""

        e: int = dataclasses.field(default=9, kw_only=True)

    class Loose(Plain):
        """No data class itself."""

    return SimpleNamespace(
        Plain=Plain, Checked=Checked, Empty=Empty, Own=Own, Heir=Heir, Second=Second, Loose=Loose
    )


OF_SLOTS = "super(type, obj): obj "
"""How begins what the standard library of Python 3.11 to 3.13 says for any attribute that is no field, of a class with slots."""
CALLS: tuple[tuple[str, tuple[Any, ...], dict[str, Any]], ...] = (
    ("Plain", (1,), {}),
    ("Plain", (1, 2.0, [3], "y"), {}),
    ("Plain", (), {"a": 1, "c": [5]}),
    ("Plain", (), {}),
    ("Plain", (1,), {"f": 2}),
    ("Checked", (1,), {"d": 5}),
    ("Checked", (-1,), {}),
    ("Checked", (1, 2), {}),
    ("Empty", (), {}),
    ("Own", (2,), {}),
    ("Heir", (1,), {"e": 2}),
    ("Second", (1,), {"e": 2}),
    ("Loose", (1, 3.0), {}),
)


def outcome(call: Callable[[], Any]) -> Any:
    try:
        return call()
    except Exception as error:
        return type(error), str(error)


def _changed(one: Any) -> str:
    changed = dataclasses.replace(one, a=5)
    return f"{changed.a} {changed}" if "object at" not in repr(changed) else f"{changed.a}"


def told(of: SimpleNamespace) -> list[Any]:
    """Everything that can be seen of the classes and their objects."""
    out: list[Any] = []
    for name, kind in vars(of).items():
        out += [name, str(inspect.signature(kind)), getattr(kind, "__slots__", None), kind.__match_args__]
        out += [[(f.name, f.type, f.init, f.kw_only) for f in dataclasses.fields(kind)]]
        out += [typing.get_type_hints(kind.__init__), kind.__init__.__qualname__, kind.__doc__]
        out += [getattr(kind.__dataclass_params__, one) for one in ("init", "repr", "eq", "order", "frozen")]
    for name, args, more in CALLS:
        kind = getattr(of, name)
        one = outcome(partial(kind, *args, **more))
        if isinstance(one, tuple):
            out.append(one)
            continue
        same = kind(*args, **more)
        out += [repr(one) if "object at" not in repr(one) else "as of object"]
        out += [one == same, one == 1, one.__eq__(1)]
        out.append(outcome(partial(hash, one)) if kind.__dataclass_params__.eq else "as of object")
        out += [outcome(partial(dataclasses.asdict, one)), outcome(partial(_changed, one))]
        out += [outcome(partial(setattr, one, "a", 5)), outcome(partial(delattr, one, "a"))]
        out.append(outcome(partial(setattr, one, "other", 5)))
    return out


@pytest.mark.parametrize("how", HOW, ids=str)
def test_all_that_can_be_seen_is_equal(how: dict[str, bool]) -> None:
    mine, theirs = told(classes(records.dataclass, how)), told(classes(dataclasses.dataclass, how))
    assert len(mine) == len(theirs) > 100
    for a, b in zip(mine, theirs, strict=True):
        if isinstance(b, tuple) and OF_SLOTS in str(b[-1:]):
            assert a in (None, b) or a[0] is dataclasses.FrozenInstanceError
        else:
            assert a == b


@records.dataclass(frozen=True, slots=True)
class Kept:
    """What is pickled."""

    a: int
    b: tuple[int, ...] = ()


def test_it_survives_pickling() -> None:
    one = Kept(1, (2, 3))
    assert pickle.loads(pickle.dumps(one)) == one
    assert one.__getstate__() == [1, (2, 3)]  # what the standard library writes


def test_one_that_holds_itself_has_a_repr() -> None:
    one = Kept(1)
    object.__setattr__(one, "b", one)
    assert repr(one) == "Kept(a=1, b=...)"


def test_it_needs_no_doc_string_and_no_brackets() -> None:
    @records.dataclass
    class Bare:
        a: int = 1

    assert Bare() == Bare(1)
