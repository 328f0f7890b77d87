"""What a value is, asked before anything is done with it: whatever it is, the answer is yes or no."""

from __future__ import annotations

from typing import Any

import numpy as np

from lampyris._core.scalars import is_real, is_whole


def numbers(value: object, shape: tuple[int | None, ...]) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """A float64 array of its own, made of numbers; None if it is none, or of another shape.

    Parameters
    ----------
    value : anything; an empty list is an array of any shape without elements.
    shape : length of each axis; None: any.
    """
    array = _array(value, "fiu")
    if array is None:
        return None
    if array.shape == (0,) and not shape[0]:
        array = array.reshape((0, *(n or 0 for n in shape[1:])))
    return np.array(array, dtype=np.float64, order="C") if fits(array, shape) else None


def fits(array: np.ndarray[Any, np.dtype[Any]], shape: tuple[int | None, ...]) -> bool:
    """Whether an array has a shape; None: any length."""
    return array.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, array.shape, strict=True))


def cell_of(value: object) -> tuple[int, int] | None:
    """A pair of whole numbers x, y; None if it is none. Nothing is rounded."""
    if isinstance(value, tuple | list) or (isinstance(value, np.ndarray) and value.ndim == 1):
        pair = tuple(value)
        if len(pair) == 2 and is_whole(pair[0]) and is_whole(pair[1]):
            return int(pair[0]), int(pair[1])
    return None


def items_of(value: object) -> tuple[object, ...]:
    """The items of a tuple, list or array; anything else is one item."""
    many = isinstance(value, tuple | list) or (isinstance(value, np.ndarray) and value.ndim > 0)
    return tuple(value) if many else (value,)  # type: ignore[arg-type]


def cells(value: object) -> np.ndarray[Any, np.dtype[np.int32]] | None:
    """An int32 array (n, 2) of its own, made of whole numbers; None if it is none."""
    if type(value) is np.ndarray and value.dtype == np.int32 and value.ndim == 2 and value.shape[1] == 2:
        return np.array(value, order="C")  # what simulations make, dozens of times a run
    array = _array(value, "iu")
    if array is None or array.size % 2 or (array.size and array.shape[-1] != 2) or array.ndim not in (1, 2):
        return None
    if array.dtype != np.int32 and array.size and (array.min() < -(2**31) or array.max() >= 2**31):
        return None
    return np.array(array, dtype=np.int32, copy=True).reshape(-1, 2)


def array_of(value: object) -> np.ndarray[Any, np.dtype[Any]] | None:
    """What NumPy makes of a value; None if it makes nothing of it."""
    try:
        return np.asarray(value)
    except Exception:  # the length or the items of what is no array may do whatever they like
        return None


def _array(value: object, kinds: str) -> np.ndarray[Any, np.dtype[Any]] | None:
    """An array of numbers of these kinds; Python's own that no such array holds are looked at one by one."""
    array = array_of(value)
    if array is None or (array.dtype.kind == "O" and not (array.size and "f" in kinds)):
        return None
    if array.dtype.kind == "O":
        if not all(is_real(one) for one in array.flat):
            return None
        array = array.astype(np.float64)
    return array if array.dtype.kind in kinds or not array.size else None
