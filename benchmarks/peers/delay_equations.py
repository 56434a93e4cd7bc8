"""jitcdde: Shampine and Thompson's method of order 3(2) on a right-hand side that is compiled as C."""

from __future__ import annotations

import contextlib
import tempfile
import time
import warnings
from functools import cache

import numpy as np
import symengine
from jitcdde import jitcdde, t, y

from benchmarks.orbits import DELAY, ORBITS, Floats, free_motion, free_rates

_C22 = 0.052


class JitcDDE:
    """Orbits about Eros under delayed feedback, one after the other; gains are parameters of the compiled function.

    The free first orbit is given as points with slopes, between which the package interpolates by cubics: so many that
    they do not matter.

    Args:
        tolerance: relative and absolute.
    """

    package = "jitcdde"
    method = "order 3(2), compiled"

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.setting = f"tolerance {tolerance:.0e}"

    def __call__(self, gains: Floats) -> Floats:
        """Return the states at the ends of the controlled orbits, (r, orbits, 4), for gains (r, 4)."""
        return np.array([self._one(row) for row in gains])

    def _one(self, gains: Floats) -> Floats:
        equation = _equation()
        equation.purge_past()
        count = int(np.clip(4.0 * self.tolerance**-0.25, 300, 10_000))
        for moment, state, slope in _past(count):
            equation.add_past_point(moment, state, slope)
        equation.set_integration_parameters(
            rtol=self.tolerance, atol=self.tolerance, first_step=1e-3, min_step=1e-13, pws_rtol=0.0, pws_atol=0.0
        )
        equation.set_parameters(*gains)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            equation.step_on_discontinuities()
            return np.array([equation.integrate(DELAY * (k + 1)) for k in range(1, ORBITS + 1)])


@cache
def _past(count: int) -> list[tuple[float, Floats, Floats]]:
    """Return times, states and slopes of the free motion."""
    moments = np.linspace(0.0, DELAY, count)
    states = [free_motion()(moment) for moment in moments]
    return [(moment, state, free_rates(moment, state)) for moment, state in zip(moments, states, strict=True)]


def _right_hand_side(a: object, b: object, c: object, d: object) -> list[object]:
    px, py, vx, vy = (y(i) for i in range(4))
    square = px**2 + py**2
    inverse = 1 / symengine.sqrt(square)
    common = 1 - inverse**3 - 15 * _C22 * (px**2 - py**2) * inverse**7
    e = [y(i) - y(i, t - DELAY) for i in range(4)]
    along = -(a * e[0] + b * e[1] + c * e[2] + d * e[3])
    across = -(-b * e[0] + a * e[1] - d * e[2] + c * e[3])
    return [
        vx,
        vy,
        2 * vy + px * (common + 6 * _C22 * inverse**5) + along,
        -2 * vx + py * (common - 6 * _C22 * inverse**5) + across,
    ]


_BUILT: list[tuple[jitcdde, float]] = []


def build_seconds() -> float:
    """Return the seconds on the clock that the compilation took."""
    _equation()
    return _BUILT[0][1]


def _equation() -> jitcdde:
    """Return the compiled equation; the package reads the project file of the directory it is called in."""
    if not _BUILT:
        gains = symengine.symbols("a b c d")
        begin = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            equation = jitcdde(_right_hand_side(*gains), n=4, control_pars=gains, max_delay=DELAY, verbose=False)
            equation.compile_C(simplify=False, do_cse=False, verbose=False)
        _BUILT.append((equation, time.perf_counter() - begin))
    return _BUILT[0][0]
