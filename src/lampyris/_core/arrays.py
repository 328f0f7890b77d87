"""The arrays of nouns: made of what is given, read-only, or refused by name."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris._core import predicates as checks
from lampyris.errors import SettingError, shown
from lampyris.typing import Cells, Floats


def numbers_of(
    noun: str, name: str, value: object, shape: tuple[int | None, ...], *, finite: bool = True
) -> Floats:
    """Numbers of a shape (None: any length) as a float64 array.

    Raises
    ------
    SettingError : ``ARRAY``.
    """
    array = checks.numbers(value, shape)
    if array is None or (finite and not np.isfinite(array).all()):
        kind = "finite numbers" if finite else "numbers"
        raise _refused(noun, name, value, f"{kind} of shape {_shape_text(shape)}")
    array.setflags(write=False)
    return array


def whole_of(noun: str, name: str, value: object, shape: tuple[int | None, ...]) -> NDArray[np.int64]:
    """Whole numbers of a shape as an int64 array.

    Raises
    ------
    SettingError : ``ARRAY``.
    """
    array = checks.array_of(value)
    fits = array is not None and checks.fits(array, shape) and (array.dtype.kind in "iu" or not array.size)
    if array is None or not fits or (array.dtype.kind == "u" and array.size and array.max() >= 2**63):
        raise _refused(noun, name, value, f"whole numbers of shape {_shape_text(shape)}")
    made = np.array(array, dtype=np.int64)
    made.setflags(write=False)
    return made


def cells_of(noun: str, name: str, value: object) -> Cells:
    """Cells, (n, 2), as an int32 array.

    Raises
    ------
    SettingError : ``ARRAY``.
    """
    array = checks.cells(value)
    if array is None:
        raise _refused(noun, name, value, "whole numbers of shape (n, 2)")
    array.setflags(write=False)
    return array


def distinct(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """The values of an array of whole numbers, ascending, each once; ``np.unique`` imports masked arrays for that."""
    ordered = np.sort(values, axis=None)
    new = np.concatenate((np.ones(min(1, ordered.size), dtype=np.bool_), ordered[1:] != ordered[:-1]))
    once: NDArray[np.int64] = ordered[new]
    return once


def any_true(mask: NDArray[np.bool_]) -> bool:
    """Whether any element of a mask, stored as 1, is True: of a few thousand in a tenth of the time of ``mask.any()``."""
    return b"\x01" in mask.tobytes()


def items_of(noun: str, name: str, value: object) -> tuple[object, ...]:
    """The items of a tuple or list.

    Raises
    ------
    SettingError : ``ARRAY``.
    """
    if not isinstance(value, tuple | list):
        raise _refused(noun, name, value, "a tuple")
    return tuple(value)


def _refused(noun: str, name: str, value: object, allowed: str) -> SettingError:
    return SettingError("ARRAY", shown(value), where=f"{noun}.{name}", allowed=allowed)


def _shape_text(shape: tuple[int | None, ...]) -> str:
    inside = ", ".join("n" if n is None else str(n) for n in shape)
    return f"({inside},)" if len(shape) == 1 else f"({inside})"


def index_array(values: object) -> NDArray[np.intp]:
    """Whole numbers as the index type of the platform, which ``np.repeat``, ``np.bincount`` and ``reduceat`` want: where it
    has 32 bits (Pyodide) they refuse int64. Nothing is copied where it has 64."""
    return np.asarray(values, dtype=np.intp)
