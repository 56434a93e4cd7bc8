"""A user's own plant, given as a function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.plants.state import Event
from fracctl.units import Scales

_RELATIVE_STEP = 1e-3
"""Of a fourth-order difference: truncation near 1e-13, rounding near 1e-13."""


class FunctionPlant:
    """The plant x' = f(t, x, u).

    Args:
        f: takes t (b,), x (b, n) and u (b, m) and returns x', (b, n); it must not change its arguments.
        n_states: n.
        n_controls: m.
        state_names: names of the n states; default x1 … xn (x for n = 1).
        scales: SI value of the units of length and time; None for a dimensionless plant.
        events: what ends a run, or is recorded in it.
        jacobians: takes what f takes and returns ∂f/∂x (b, n, n) and ∂f/∂u (b, n, m); None for differences of fourth
            order, with errors near 1e-12.
        smooth: whether f has many derivatives in t and x, so that error estimates may count on the order of a solver.

    Raises:
        ArgumentError: a number is not positive, the names do not fit, or f returns another shape (when it is called).
    """

    def __init__(
        self,
        f: Callable[[Floats, Floats, Floats], Any],
        n_states: int,
        n_controls: int,
        state_names: Sequence[str] | None = None,
        scales: Scales | None = None,
        events: Sequence[Event] = (),
        jacobians: Callable[[Floats, Floats, Floats], tuple[Floats, Floats]] | None = None,
        smooth: bool = False,
    ) -> None:
        for name, value in (("n_states", n_states), ("n_controls", n_controls)):
            if value < 1 or value != int(value):
                raise ArgumentError(name, value, "must be a whole number above 0")
        default = ("x",) if n_states == 1 else tuple(f"x{i + 1}" for i in range(n_states))
        self.state_names: tuple[str, ...] = default if state_names is None else tuple(state_names)
        if len(self.state_names) != n_states or len(set(self.state_names)) != n_states:
            raise ArgumentError("state_names", self.state_names, f"must be {n_states} different names")
        self.n_states, self.n_controls = n_states, n_controls
        self.scales, self.events = scales, tuple(events)
        self._f, self._jacobians, self.smooth = f, jacobians, smooth

    def rates(self, t: Floats, x: Floats, u: Floats) -> Floats:
        """Return f(t, x, u), (b, n).

        Raises:
            ArgumentError: f returns another shape.
        """
        value = np.asarray(self._f(t, x, u), dtype=np.float64)
        if value.shape != x.shape:
            allowed = f"must return the shape of its x, (b, {self.n_states}), here {x.shape}"
            raise ArgumentError("f", f"a function that returned {value.shape}", allowed)
        return value

    def jacobians(self, t: Floats, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return ∂f/∂x, (b, n, n), and ∂f/∂u, (b, n, m)."""
        if self._jacobians is not None:
            return self._jacobians(t, x, u)
        return _slopes(lambda y: self.rates(t, y, u), x), _slopes(lambda v: self.rates(t, x, v), u)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self.state_names)})"


def _slopes(function: Callable[[Floats], Floats], at: Floats) -> Floats:
    """Return the derivatives of a function of (b, k) by differences of fourth order, (b, n, k)."""
    columns = []
    for i in range(at.shape[1]):
        step = np.zeros_like(at)
        step[:, i] = _RELATIVE_STEP * np.maximum(np.abs(at[:, i]), 1.0)
        near = function(at + step) - function(at - step)
        far = function(at + 2.0 * step) - function(at - 2.0 * step)
        columns.append((8.0 * near - far) / (12.0 * step[:, i, None]))
    return np.stack(columns, axis=2)
