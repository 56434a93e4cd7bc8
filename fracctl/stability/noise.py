"""How measurement noise comes through to the control."""

from __future__ import annotations

from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.characteristic.winding import unstable_zeros
from fracctl.errors import ArgumentError
from fracctl.loop import ClosedLoop
from fracctl.stability.frequency import FrequencyResponse, over

SAMPLE_PERIOD = 6.313e-3
"""10 s at the mean motion of a chief at 10 000 km."""
_LOWEST, _PANELS_PER_DECADE, _NODES = 1e-4, 8, 10
"""Below the lowest frequency is one panel; above, panels are even in the logarithm."""
_AT_ONCE = 512


def noise_gain(loop: ClosedLoop, sample_period: float = SAMPLE_PERIOD) -> Any:
    """Return the rms of the control for white noise of unit rms in every position, (b,) or a number.

        g² = 1/ω_N ∫₀^{ω_N} ‖C (M + C)⁻¹ M‖_F² dω,        ω_N = π / T_s

    Samples of period T_s hold the noise up to the Nyquist frequency ω_N, evenly, so its rms is 1 whatever the law; the
    band must end somewhere, for a law that differentiates positions passes high frequencies without limit. The law is
    taken as it is, continuous. For small T_s g is k_D ω_N/√3 of PD, k_D ω_N^α/√(2α + 1) of PD^α, k_P + k_D/T_f with a
    lag. In units of 1/time² (times n² in SI units). By Gauss-Legendre quadrature on panels of log ω: to eight digits,
    to a per cent where a pole of the loop is damped by 1 %. NaN for a loop that is not stable.

    Args:
        loop: of a linear plant and a linear law.
        sample_period: T_s > 0, dimensionless.

    Raises:
        ArgumentError: T_s is not positive.
        UnsupportedError: the loop is not linear, has delays, or a term of the highest order of its coordinate.
    """
    if not (np.isfinite(sample_period) and sample_period > 0.0):
        raise ArgumentError("sample_period", sample_period, "must be positive")
    response = FrequencyResponse(loop)
    unstable, marginal = unstable_zeros(response.matrix)
    found = np.full(response.batch, np.nan)
    sound = np.flatnonzero(~marginal & (unstable == 0.0))
    omega, weights = _rule(np.pi / sample_period)
    for first in range(0, sound.size, _AT_ONCE):
        rows = sound[first : first + _AT_ONCE]
        found[rows] = np.sqrt(_power(response, omega, rows) @ weights)
    return float(found[0]) if loop.batch is None else found


def _power(response: FrequencyResponse, omega: Floats, rows: Array) -> Floats:
    """Return ‖C S_o‖_F², (n, k), S_o the sensitivity at the plant's output."""
    control, plant = response(omega[None], rows)
    through = over(control, plant + control) @ plant
    power: Floats = (np.abs(through) ** 2).sum(axis=(-2, -1))
    return power


def _rule(nyquist: float) -> tuple[Floats, Floats]:
    """Return nodes on (0, ω_N) and weights that sum to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    lowest = min(_LOWEST, 1e-3 * nyquist)
    panels = int(np.ceil(_PANELS_PER_DECADE * np.log10(nyquist / lowest)))
    edges = np.linspace(np.log(lowest), np.log(nyquist), 1 + panels)
    steps = np.diff(edges)
    omega = np.exp(edges[:-1, None] + steps[:, None] * nodes)
    densities = omega * steps[:, None] * weights
    all_nodes, all_weights = np.append(lowest * nodes, omega), np.append(lowest * weights, densities)
    return all_nodes, all_weights / nyquist
