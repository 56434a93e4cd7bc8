"""One step of the Runge-Kutta method DOP853 of order 8 with its continuous extension of order 7, as matrices.

With Y = [x, h k_1, …, h k_16] stage s takes place at x_s = COMBINE[s] Y and t + NODES[s] h; stage 13 is the end of the
step. The extension is x(t + θh) = BASIS(θ) C with eight rows C = DENSE Y.

Source: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, section II.5 and II.6; the coefficients are
SciPy's.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as table

from fracctl.arrays import Floats

STAGES = 16
END = 12
"""Index of the stage at the end of the step."""
ROWS = 8
"""Rows of the extension."""
ORDER = 8
NODES: Floats = np.asarray(table.C, dtype=np.float64)
COMBINE: Floats = np.concatenate([np.ones((STAGES, 1)), table.A], axis=1)


def basis(theta: Floats) -> Floats:
    """Return the values at θ of the polynomials that C is made of, (…, 8): 1, θ, θ(1-θ), θ²(1-θ), θ²(1-θ)², …."""
    rows = [np.ones_like(theta), theta]
    for i in range(ROWS - 2):
        rows.append(rows[-1] * ((1.0 - theta) if i % 2 == 0 else theta))
    return np.stack(rows, axis=-1)


def _dense() -> Floats:
    rows = np.zeros((ROWS, STAGES + 1))
    change = COMBINE[END].copy()
    change[0] = 0.0
    first, last = np.eye(STAGES + 1)[[1, END + 1]]
    rows[0, 0] = 1.0
    rows[1:4] = change, first - change, 2.0 * change - first - last
    rows[4:, 1:] = table.D
    return rows


DENSE: Floats = _dense()
AT_STAGES: Floats = basis(NODES)
"""Takes C to the values at the stages, (16, 8)."""
SAMPLES: Floats = np.sin(0.5 * np.pi * np.arange(ROWS) / (ROWS - 1)) ** 2
"""Places in a step from whose values `FIT` makes C, (8,)."""
FIT: Floats = np.asarray(np.linalg.inv(basis(SAMPLES)), dtype=np.float64)


def local_error(values: Floats, scale: Floats) -> Floats:
    """Return the estimated error of steps from Y (17, b n) over what is allowed, `scale` (b, n), (b,): 1 is allowed."""
    fifth, third = ((weights @ values[1 : END + 2]).reshape(scale.shape) / scale for weights in (table.E5, table.E3))
    square = (fifth**2).sum(axis=1)
    both = square + 0.01 * (third**2).sum(axis=1)
    error: Floats = square / np.sqrt(np.where(both > 0.0, both, 1.0) * scale.shape[1])
    return error
