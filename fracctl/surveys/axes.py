"""Axes of a grid: ``start:stop:step``, a number, or a list of values."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, InvalidOperation

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError

LARGEST_AXIS = 1_000_000
"""More values than this on one axis are taken for a mistyped step."""

_FORM = "must be start:stop:step, a number, or a list of numbers"
_REACH = 1e-9
"""How near the last value must come to `stop`, in steps."""


def axis_values(spec: str | float | Sequence[float], name: str = "axis") -> Floats:
    """Return the values of an axis.

    ``start:stop:step`` includes both ends. Its values are exact decimals: ``0.80:1.00:0.01`` holds 0.94, not
    0.9400000000000001.

    Args:
        spec: ``start:stop:step``, a number, or a sequence of numbers.
        name: what messages call the axis.

    Raises:
        ArgumentError: `spec` has none of these forms, the step is 0, leads away from `stop` or misses it, a value is
            repeated, or there are more than `LARGEST_AXIS` values.
    """
    if isinstance(spec, str):
        return _range(spec, name)
    given = [spec] if isinstance(spec, int | float) else list(spec)
    if any(isinstance(value, bool) or not isinstance(value, int | float) for value in given):
        raise ArgumentError(name, repr(spec), _FORM)
    values = np.array(given, dtype=np.float64)
    if not values.size or not np.all(np.isfinite(values)):
        raise ArgumentError(name, repr(spec), "must hold at least one value, and finite numbers only")
    if np.unique(values).size != values.size:
        raise ArgumentError(name, repr(spec), "must not repeat a value")
    return values


def _range(spec: str, name: str) -> Floats:
    try:
        numbers = [Decimal(part.strip()) for part in spec.split(":")]
    except InvalidOperation:
        raise ArgumentError(name, repr(spec), _FORM) from None
    if len(numbers) not in (1, 3) or not all(number.is_finite() for number in numbers):
        raise ArgumentError(name, repr(spec), _FORM)
    if len(numbers) == 1:
        return np.array([float(numbers[0])])
    start, stop, step = numbers
    count = _steps(start, stop, step, name, spec)
    values = [float(start + i * step) for i in range(count)]
    return np.array([*values, float(stop)])


def _steps(start: Decimal, stop: Decimal, step: Decimal, name: str, spec: str) -> int:
    if step == 0:
        raise ArgumentError(name, repr(spec), "must have a step other than 0")
    length = (stop - start) / step
    if length < 0:
        raise ArgumentError(name, repr(spec), "must have a step that leads from start to stop")
    if length >= LARGEST_AXIS:
        raise ArgumentError(name, repr(spec), f"must have at most {LARGEST_AXIS} values")
    count = int(length.to_integral_value())
    if abs(length - count) > Decimal(_REACH):
        last = start + int(length) * step
        raise ArgumentError(
            name, repr(spec), "must reach stop in whole steps", f"the last value is {last} or {last + step}"
        )
    return count
