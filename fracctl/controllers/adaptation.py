"""The adaptive gains of Zhong et al. as functions of what drives them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from fracctl.arrays import Floats
from fracctl.compiling import helper_with
from fracctl.errors import ArgumentError

NODES = 600
"""Of a table; its cubics err by less than 1e-6 of ϑ."""
_FASTEST = 50.0
"""Exponent 1/(K₁ϑ) beyond which the adaptation is as good as a jump: e^-50 of σ."""
_CELL, _CELL_WEIGHTS = np.polynomial.legendre.leggauss(8)


@lru_cache(maxsize=4096)
def adaptation_table(rate: float, weight: float, start: float) -> Floats:
    """Return σ, ϑ(σ) and dϑ/dσ at the nodes of a table, (3, NODES).

        dϑ/dσ = e^(1/(K₁ϑ)) (1 - K₁ϑ) + ζφ K₁ e^(-2/(K₁ϑ))        (Zhong et al., Eq. 38)

    with dσ = ‖S_r2‖₁ df for ϑ₁ and ‖S_r2‖² df for ϑ₂. ϑ tends to the zero of the right hand side, a little above 1/K₁;
    the table ends where it is as good as there. As an equation in time it is too stiff to follow: e^(1/(K₁ϑ)) is e^20
    at ϑ = 1. A table begins at ϑ = 1/(50 K₁) at least, which it reaches at once from below.

    Args:
        rate: K₁.
        weight: ζφ.
        start: ϑ(0), positive and below the limit.

    Raises:
        ArgumentError: ϑ(0) is not below the limit.
    """

    def inverse(theta: Floats) -> Floats:
        """Return dσ/dϑ."""
        share = 1.0 / (rate * theta)
        slowed: Floats = np.exp(-share) / (1.0 - rate * theta + weight * rate * np.exp(-3.0 * share))
        return slowed

    limit = brentq(lambda y: 1.0 - y + weight * rate * np.exp(-3.0 / y), 1e-3, 1.0 + 2.0 * weight * rate + 1.0) / rate
    if not start < limit:
        raise ArgumentError("vartheta_0", start, f"must lie below {limit:.6g}, where the adaptation ends")
    share = 1.0 - np.linspace(0.0, 1.0, NODES + 1)[:-1]
    first = max(start, 1.0 / (_FASTEST * rate))
    theta = 1.0 / (1.0 / limit + (1.0 / first - 1.0 / limit) * share**3)
    half = 0.5 * np.diff(theta)
    cells = half * (inverse(theta[:-1, None] + half[:, None] * (_CELL + 1.0)) @ _CELL_WEIGHTS)
    sigma = np.concatenate([[0.0], np.cumsum(cells)])
    return np.stack([sigma, theta, 1.0 / inverse(theta)])


@helper_with(error_model="numpy")
def looked_up(sigma: float, table: Floats, first: int) -> float:
    """Return ϑ(σ) of a flat table that begins at `first`, by cubics; behind its end the last value."""
    low, high = 0, NODES - 1
    if sigma >= table[first + high]:
        last: float = table[first + NODES + high]
        return last
    while high - low > 1:
        middle = (low + high) // 2
        if table[first + middle] <= sigma:
            low = middle
        else:
            high = middle
    width = table[first + high] - table[first + low]
    y = (sigma - table[first + low]) / width
    a, b = table[first + NODES + low], table[first + NODES + high]
    slope, end = table[first + 2 * NODES + low] * width, table[first + 2 * NODES + high] * width
    value: float = a + y * (slope + y * (3.0 * (b - a) - 2.0 * slope - end + y * (2.0 * (a - b) + slope + end)))
    return value
