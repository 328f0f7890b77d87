"""What all nouns share: a short repr, HTML for notebooks, dictionaries.

NumPy is imported only where an array is met: the command line reads the declarations of nouns such as Robot before it
knows which verb runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from reprlib import Repr
from typing import TYPE_CHECKING, Any, Self

from lampyris._core import presentation
from lampyris.errors import SettingError

if TYPE_CHECKING:
    import pandas

MAX_REPR = 120
"""Characters of a noun's repr, at most."""

_BRIEF = Repr()
_BRIEF.maxtuple = _BRIEF.maxlist = _BRIEF.maxdict = _BRIEF.maxfrozenset = 3
_BRIEF.maxstring, _BRIEF.maxlong, _BRIEF.maxother = 40, 24, 60


class Noun:
    """What the nouns derive from; a dataclass with ``frozen=True, slots=True, repr=False``."""

    __slots__ = ()

    def __repr__(self) -> str:
        text = self._brief()
        return text if len(text) <= MAX_REPR else f"{text[: MAX_REPR - 4]}...{text[-1]}"

    def _brief(self) -> str:
        """The class with the fields that differ from their defaults; nouns with more to say say it in words."""
        words = []
        for f in fields(self):  # type: ignore[arg-type]
            value = getattr(self, f.name)
            default = f.default_factory() if f.default_factory is not MISSING else f.default
            if f.repr and f.init and not same(value, default):
                words.append(f"{f.name}={brief(value)}")
        return f"{type(self).__name__}({', '.join(words)})"

    def _repr_html_(self) -> str | None:
        """A table and, where there is something to draw, a small picture, for notebooks."""
        return presentation.html_of(self) if presentation.html_of is not None else None

    def to_dict(self) -> dict[str, Any]:
        """All of it as dictionaries, lists, text and numbers that JSON can hold, with ``type`` and ``version``.

        ``json.dumps(noun.to_dict(), allow_nan=False)`` works; :meth:`from_dict` makes an equal noun of it.
        """
        from lampyris._core import dict_codec

        made = dict_codec.encode(self)
        return {"type": made.pop("type"), "version": dict_codec.VERSION, **made}

    @classmethod
    def from_dict(cls, given: Mapping[str, Any]) -> Self:
        """A noun from what :meth:`to_dict` said of it.

        Raises
        ------
        SettingError : ``DICT``: another type or version, or a field that is missing, unknown or of another kind;
            and what the noun itself refuses.
        """
        from lampyris._core import dict_codec

        return dict_codec.decode(cls, given)


class Tabular:
    """Nouns that are rows over time or distance."""

    __slots__ = ()

    def _table(self, **options: Any) -> pandas.DataFrame:
        if presentation.frame_of is None:
            raise SettingError("PANDAS", "the package lampyris is not loaded", todo="import lampyris")
        return presentation.frame_of(self, **options)


def same(a: Any, b: Any) -> bool:
    """Whether two field values are equal; arrays are if their shape, element type and elements are."""
    if hasattr(a, "dtype") or hasattr(b, "dtype"):
        return _same_arrays(a, b)
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and bool(a == b or (a != a and b != b))


def _same_arrays(a: Any, b: Any) -> bool:
    import numpy as np

    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a is b or (a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind in "fc"))
    a, b = (one.item() if isinstance(one, np.generic) else one for one in (a, b))
    return not (hasattr(a, "dtype") or hasattr(b, "dtype")) and same(a, b)


def brief(value: object) -> str:
    """A field's value as the repr of its noun shows it."""
    if hasattr(value, "dtype") and hasattr(value, "shape") and value.shape:
        return f"<{value.dtype.name} {' x '.join(map(str, value.shape)) or 'number'}>"
    return _BRIEF.repr(value)
