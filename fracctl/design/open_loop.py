"""The least control effort that any control needs: a linear programme, with a proof from its dual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm
from scipy.optimize import linprog

from fracctl.arrays import Floats, finite, positive
from fracctl.errors import ArgumentError
from fracctl.plants.linear import LinearPlant

_QUADRATURE = 8
"""Gauss-Legendre nodes on each segment for the integral of the dual."""


@dataclass(frozen=True)
class OpenLoop:
    """A control that brings a plant to rest at the end of a given time with nearly the least effort."""

    times: Floats
    """Ends of the N segments and 0, (N + 1,)."""
    controls: Floats
    """υ, constant on each segment, (N, m)."""
    effort: float
    """Σ_i ∫ |υ_i| ds of these controls."""
    lower_bound: float
    """No control at all gets there with less; within the quadrature of the dual."""


def least_effort(
    plant: LinearPlant, initial_state: ArrayLike, time: float, peak: float, segments: int = 400
) -> OpenLoop | None:
    """Return the control of least effort from a state to rest at the origin, None if the time is too short.

        min Σ_i ∫₀ᵀ |υ_i| ds,    x(T) = 0,    |υ_i| ≤ υ̂,        x = [ξ, ξ'],  ξ'' = S ξ + D ξ' + υ

    With υ constant on segments this is a linear programme. A multiplier λ of x(T) = 0 proves that no control needs
    less than -λᵀ Φ(T, 0) x(0) - υ̂ Σ_i ∫₀ᵀ max(0, |(Φ(T, s) B)ᵢᵀ λ| - 1) ds.

    Args:
        plant: with m positions.
        initial_state: [ξ(0), ξ'(0)], (2m,).
        time: T > 0.
        peak: υ̂ > 0.
        segments: N; the effort exceeds the least by O(1/N²).

    Raises:
        ArgumentError: a number is not positive, or the state has a wrong shape.
    """
    m = plant.n_controls
    start = finite("initial_state", initial_state)
    if start.shape != (2 * m,):
        raise ArgumentError("initial_state", f"of shape {start.shape}", f"must have shape ({2 * m},)")
    for name, value in (("time", time), ("peak", peak), ("segments", segments)):
        positive(name, value)
    flow, response = _segment(plant, time / segments)
    reach = _after(flow, response, segments)
    target = -np.linalg.matrix_power(flow, segments) @ start
    scale = np.abs(reach).max(axis=1)
    balanced = reach / scale[:, None]
    cost = np.full(2 * m * segments, time / segments)
    both = np.concatenate([balanced, -balanced], axis=1)
    found = linprog(cost, A_eq=both, b_eq=target / scale, bounds=(0.0, peak), method="highs")
    if found.x is None or found.fun is None:
        return None
    forward, backward = np.split(found.x, 2)
    multiplier = found.eqlin.marginals / scale
    bound = float(multiplier @ target) - peak * _excess(plant, time, segments, multiplier)
    times = np.linspace(0.0, time, segments + 1)
    return OpenLoop(times, (forward - backward).reshape(segments, m), float(found.fun), bound)


def _segment(plant: LinearPlant, step: float) -> tuple[Floats, Floats]:
    """Return what a state becomes over a step, (2m, 2m), and what a constant control adds, (2m, m)."""
    m = plant.n_controls
    motion = np.zeros((3 * m, 3 * m))
    motion[:m, m : 2 * m] = motion[m : 2 * m, 2 * m :] = np.eye(m)
    motion[m : 2 * m, :m], motion[m : 2 * m, m : 2 * m] = plant.stiffness, plant.damping
    both: Floats = expm(motion * step)[: 2 * m]
    return both[:, : 2 * m], both[:, 2 * m :]


def _after(flow: Floats, response: Floats, segments: int) -> Floats:
    """Return what the response to each segment has become at the end, side by side from the first to the last."""
    columns = [response]
    for _ in range(segments - 1):
        columns.append(flow @ columns[-1])
    return np.concatenate(columns[::-1], axis=1)


def _excess(plant: LinearPlant, time: float, segments: int, multiplier: Floats) -> float:
    """Return Σ_i ∫ max(0, |(Φ(T, s) B)ᵢᵀ λ| - 1) ds."""
    m, step = plant.n_controls, time / segments
    flow, _ = _segment(plant, step)
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE)
    total = 0.0
    for node, weight in zip(nodes, weights, strict=True):
        kick = _segment(plant, 0.5 * step * (1.0 - node))[0][:, m:]
        value = np.abs(multiplier @ _after(flow, kick, segments))
        total += 0.5 * step * float(weight) * float(np.maximum(value - 1.0, 0.0).sum())
    return total
