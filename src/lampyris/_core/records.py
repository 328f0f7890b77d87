"""Data classes as those of the standard library, made four times as quickly.

The standard library compiles the source of up to six methods for each class: with the classes of a short call it took
35 ms, a fifth of the call. Here only ``__init__`` is compiled, when it is asked for; the other methods are shared code
over the names of the fields. Modules that a short call imports take ``dataclass`` from here; ``field``, ``fields`` and
``replace`` are those of the standard library, and a type checker sees its ``dataclass``.
"""

from __future__ import annotations

import sys
from dataclasses import MISSING, Field, FrozenInstanceError, fields
from dataclasses import dataclass as _standard
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, **how):
        """A data class; see :func:`dataclasses.dataclass` for what may be asked."""

        def make(kind):
            return _made(kind, **how)

        return make if cls is None else make(cls)


OWN = ("__init__", "__setattr__", "__delattr__", "__eq__", "__hash__")
"""A class that defines one of these itself is left to the standard library."""


def _made(
    kind: type[Any],
    *,
    repr: bool = True,
    eq: bool = True,
    frozen: bool = False,
    slots: bool = False,
    kw_only: bool = False,
    **rare: bool,
) -> type[Any]:
    """The class with its methods. What is asked for rarely is left to the standard library."""
    given = vars(kind)
    derived = any("__dataclass_fields__" in vars(base) for base in kind.__mro__[1:])
    special = any("InitVar" in str(hint) for hint in given.get("__annotations__", {}).values())
    if rare or derived or special or not frozen or not kind.__doc__ or any(name in given for name in OWN):
        return _standard(
            repr=repr, eq=eq, frozen=frozen, slots=slots, kw_only=kw_only, **rare
        )(kind)  # fmt: skip
    own_repr = "__repr__" in given
    made: Any = _standard(init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)(kind)
    asked = made.__dataclass_params__
    asked.init, asked.repr, asked.eq, asked.frozen = True, repr, eq, True
    parts = fields(made)
    names = tuple(f.name for f in parts)
    made.__init__ = _Initialiser(made, slots)
    methods = [*_frozen(made, frozenset(names))]
    if repr and not own_repr:
        methods.append(_repr(tuple(f.name for f in parts if f.repr)))
    if eq:
        methods.append(_eq(_values(tuple(f.name for f in parts if f.compare))))
        hashed = (f for f in parts if (f.compare if f.hash is None else f.hash))
        methods.append(_hash(_values(tuple(f.name for f in hashed))))
    if slots:
        methods += [m for m in _state(names) if m.__name__ not in given]
    for method in methods:
        method.__qualname__ = f"{made.__qualname__}.{method.__name__}"
        method.__module__ = made.__module__
        setattr(made, method.__name__, method)
    return made  # type: ignore[no-any-return]


class _Factory:
    """What stands for a default that is made for each object."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY = _Factory()


class _Initialiser:
    """``__init__`` until it is asked for: most classes are imported for a short call and never made."""

    def __init__(self, kind: Any, slots: bool) -> None:
        self._kind, self._slots = kind, slots

    def __get__(self, one: Any, kind: Any) -> Any:
        init = _init(self._kind, fields(self._kind), self._slots)
        init.__qualname__, init.__module__ = f"{self._kind.__qualname__}.__init__", self._kind.__module__
        self._kind.__init__ = init
        return init.__get__(one, kind)


def _init(kind: Any, parts: tuple[Field[Any], ...], slots: bool) -> Any:
    """``__init__``, as the standard library writes it."""
    scope: dict[str, Any] = {"_set": object.__setattr__, "_FACTORY": _FACTORY}
    me = "_self" if any(f.name == "self" for f in parts) else "self"
    words: tuple[list[str], list[str]] = [me], []
    lines = []
    for f in parts:
        name, value = f.name, f.name
        has, makes = f.default is not MISSING, f.default_factory is not MISSING
        default = f"_of_{name}"
        if has or makes:
            scope[default] = f.default if has else f.default_factory
        if f.init:
            equals = f"={default}" if has else "=_FACTORY" if makes else ""
            words[bool(f.kw_only)].append(name + equals)
            if makes:
                value = f"{default}() if {name} is _FACTORY else {name}"
        elif makes or (has and slots):
            value = f"{default}()" if makes else default
        else:
            continue
        lines.append(f"  _set({me},{name!r},{value})")
    if hasattr(kind, "__post_init__"):
        lines.append(f"  {me}.__post_init__()")
    taken = ",".join((*words[0], *(("*", *words[1]) if words[1] else ())))
    todo = "\n".join(lines or ["  pass"])
    source = f"def make({','.join(scope)}):\n def __init__({taken}):\n{todo}\n return __init__"
    made: dict[str, Any] = {}
    exec(source, sys.modules[kind.__module__].__dict__, made)
    init = made["make"](**scope)
    init.__annotations__ = {f.name: f.type for f in parts if f.init} | {"return": None}
    return init


def _frozen(kind: Any, names: frozenset[str]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    def __setattr__(self: Any, name: str, value: Any) -> None:
        if type(self) is kind or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(kind, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is kind or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(kind, self).__delattr__(name)

    return __setattr__, __delattr__


def _repr(names: tuple[str, ...]) -> Callable[..., Any]:
    @recursive_repr()
    def __repr__(self: Any) -> str:
        shown = ", ".join([f"{name}={getattr(self, name)!r}" for name in names])
        return f"{self.__class__.__qualname__}({shown})"

    return __repr__


def _values(names: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    """Reads these attributes of an object, as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda one: tuple(getattr(one, name) for name in names)


def _eq(values: Callable[[Any], tuple[Any, ...]]) -> Callable[..., Any]:
    def __eq__(self: Any, other: object) -> Any:
        if other.__class__ is self.__class__:
            return values(self) == values(other)
        return NotImplemented

    return __eq__


def _hash(values: Callable[[Any], tuple[Any, ...]]) -> Callable[..., Any]:
    def __hash__(self: Any) -> int:
        return hash(values(self))

    return __hash__


def _state(names: tuple[str, ...]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """What pickling writes and reads, as with the standard library."""

    def __getstate__(self: Any) -> list[Any]:
        return [getattr(self, name) for name in names]

    def __setstate__(self: Any, state: list[Any]) -> None:
        for name, value in zip(names, state, strict=True):
            object.__setattr__(self, name, value)

    return __getstate__, __setstate__
