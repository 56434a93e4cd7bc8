"""Shape checks shared by plants, laws and solvers; the sentences name the shapes that are allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fracctl.errors import ArgumentError

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Booleans = NDArray[np.bool_]
Array = NDArray[Any]


def finite(name: str, value: ArrayLike) -> Floats:
    """Return `value` as a float array; raise ArgumentError unless every entry is a finite number."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentError(name, repr(value), "must be a number or an array of numbers") from None
    bad = array[~np.isfinite(array)]
    if bad.size:
        raise ArgumentError(name, bad.flat[0], "must hold finite numbers only")
    return array


def positive(name: str, value: ArrayLike) -> float:
    """Return a positive finite number; raise ArgumentError for others."""
    number = float(finite(name, value))
    if number <= 0.0:
        raise ArgumentError(name, number, "must be positive")
    return number


def share(name: str, value: float) -> float:
    """Return a number in [0, 1]; raise ArgumentError for others."""
    number = float(finite(name, value))
    if not 0.0 <= number <= 1.0:
        raise ArgumentError(name, number, "must lie in [0, 1]")
    return number


def matrices(name: str, value: ArrayLike, rows: int) -> Floats:
    """Return gains as (b, rows, rows) or (rows, rows), checking the shape.

    For one row the shapes () and (b,) are allowed, otherwise (rows, rows) and (b, rows, rows).
    """
    array = finite(name, value)
    if rows == 1:
        if array.ndim > 1 and array.shape[-2:] != (1, 1):
            raise ArgumentError(name, f"of shape {array.shape}", "must have shape () or (b,) for one control")
        return array[..., None, None] if array.ndim <= 1 else array
    if array.ndim not in (2, 3) or array.shape[-2:] != (rows, rows):
        allowed = f"must have shape ({rows}, {rows}) or (b, {rows}, {rows}) for {rows} controls"
        raise ArgumentError(name, f"of shape {array.shape}", allowed)
    return array


def orders(name: str, value: ArrayLike, columns: int) -> Floats:
    """Return orders as (columns,) or (b, columns), checking the shape.

    A single number serves every column; (b,) is allowed for one column, otherwise (columns,) and (b, columns).
    """
    array = finite(name, value)
    if array.ndim == 0:
        return np.full(columns, float(array))
    if columns == 1 and array.ndim == 1:
        return array if array.shape == (1,) else array[:, None]
    if array.ndim > 2 or array.shape[-1] != columns:
        allowed = (
            "must have shape (), (1,) or (b,) for one control"
            if columns == 1
            else f"must have shape (), ({columns},) or (b, {columns}) for {columns} controls"
        )
        raise ArgumentError(name, f"of shape {array.shape}", allowed)
    return array


def orders_up_to_one(name: str, value: ArrayLike) -> Floats:
    """Return orders as a float array; raise ArgumentError unless all lie in (0, 1]."""
    array = finite(name, value)
    outside = array[(array <= 0.0) | (array > 1.0)]
    if outside.size:
        raise ArgumentError(name, float(outside.flat[0]), "must lie in (0, 1]")
    return array


def batch_size(**arrays: tuple[Array, int]) -> int | None:
    """Return the common batch size, None if no array is batched; each value is (array, unbatched ndim)."""
    sizes = {name: array.shape[0] for name, (array, ndim) in arrays.items() if array.ndim > ndim}
    distinct = {size for size in sizes.values() if size != 1}
    if len(distinct) > 1:
        (first, a), (second, b) = [(n, s) for n, s in sizes.items() if s != 1][:2]
        if a == b:
            (second, b) = next((n, s) for n, s in sizes.items() if s not in (1, a))
        raise ArgumentError(second, f"a batch of {b}", f"must have the same batch size as `{first}`, {a}")
    return max(sizes.values()) if sizes else None


def joined(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Return parts of a table, arrays by column, one after the other with the columns of the first."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
