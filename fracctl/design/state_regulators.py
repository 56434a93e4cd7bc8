"""Gains of linear-quadratic regulators for any plant in state form: at a point, on an orbit, and on a stored window.

With A = ∂f/∂x and B = ∂f/∂u on a free motion the regulator of x' = A x + B u is u = -K x. Under delayed feedback
u = -K (x - x(t - τ)) it is optimal up to 2τ at most, as long as x(t - τ) is free itself (Biggs, McInnes, Appendix, Eqs.
14 to 18); what it does afterwards its Floquet multipliers say. Gains belong to the plant's dimensionless equations:
R = β I with another unit of time is another β.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from fracctl.arrays import Floats, finite
from fracctl.controllers.delayed_feedback import Window
from fracctl.controllers.periodic_gain import PeriodicGain
from fracctl.design.lqr import regulator, weight
from fracctl.design.periodic_riccati import periodic_solution, stage_times
from fracctl.errors import ArgumentError
from fracctl.fractional.collocation import chebyshev_nodes
from fracctl.loop import ClosedLoop
from fracctl.plants.state import StatePlant
from fracctl.solvers.method_of_steps.solver import MethodOfSteps
from fracctl.stability.periodic_orbits import PeriodicOrbit

_FEWEST = 8
_BLOWN_UP = 1e6
"""Size of P, relative to that at the start, at which it counts as having blown up."""


def lqr_at(plant: StatePlant, state: ArrayLike, time: float = 0.0, q: ArrayLike = 1.0, r: ArrayLike = 1.0) -> Floats:
    """Return the gain K of the regulator of the plant linearised at a state and time, (m, n).

    Args:
        plant: n states, m controls.
        state: x, (n,).
        time: t, for plants that depend on it.
        q: Q ≥ 0; a number, its diagonal (n,), or (n, n).
        r: R > 0; a number (β of R = β I), its diagonal (m,), or (m, m).

    Raises:
        ArgumentError: a weight has a wrong shape or sign, or no gains stabilise the linearised plant at a finite cost.
    """
    a, b = _matrices(plant, state, time)
    n, m = b.shape
    return regulator(a, b, weight("q", q, n), weight("r", r, m, definite=True))[0]


def periodic_regulator(orbit: PeriodicOrbit, q: ArrayLike = 1.0, r: ArrayLike = 1.0, nodes: int = 100) -> PeriodicGain:
    """Return the gain K(t) of the regulator on a periodic orbit, from the periodic solution of its Riccati equation.

    Args:
        orbit: a periodic free motion.
        q: Q ≥ 0; a number, its diagonal (n,), or (n, n).
        r: R > 0; a number (β of R = β I), its diagonal (m,), or (m, m).
        nodes: Chebyshev nodes in a period.

    Raises:
        ArgumentError: a weight has a wrong shape or sign, or the equation has no periodic solution.
    """
    window = Window(orbit.plant, np.zeros(1), np.array([orbit.period]), lambda t: orbit.trajectory(t[0])[None])
    n, m = orbit.plant.n_states, orbit.plant.n_controls
    gain = regulator_on(window, weight("q", q, n), weight("r", r, m, definite=True)[None], nodes)
    if not np.isfinite(gain.values).all():
        raise ArgumentError("q", q, "must weigh every motion that does not die out by itself")
    return gain


def regulator_on(window: Window, q: Floats, r: Floats, nodes: int) -> PeriodicGain:
    """Return the same on stored windows, taken as one period each; NaN for members without a solution.

    Args:
        window: of b members.
        q: (n, n).
        r: (b, m, m) or (1, m, m).
        nodes: Chebyshev nodes in a window.

    Raises:
        ArgumentError: there are too few nodes.
    """
    if nodes < _FEWEST:
        raise ArgumentError("nodes", nodes, f"must be at least {_FEWEST}")
    edges = window.start[:, None] + window.length[:, None] * chebyshev_nodes(nodes).t
    a, b = _along(window, stage_times(edges))
    cost = b @ np.linalg.solve(r[:, None, None], np.swapaxes(b, -1, -2))
    with np.errstate(all="ignore"):
        solution = periodic_solution(a, cost, q, edges)
        ends = _along(window, edges[..., None])[1][:, :, 0]
        gains = np.linalg.solve(r[:, None], np.swapaxes(ends, -1, -2) @ solution)
    return PeriodicGain(np.asarray(gains, dtype=np.float64), window.length)


def forward_blow_up(
    plant: StatePlant, state: ArrayLike, horizon: float, q: ArrayLike = 1.0, r: ArrayLike = 1.0
) -> float:
    """Return when the solution of the paper's Eq. (20), integrated forward on a free motion, has blown up, or infinity.

        P' = P B R⁻¹ Bᵀ P - Aᵀ P - P A - Q,        P'(0) = 0 with A(0)

    (Biggs, McInnes, Appendix.) Forward the stabilising solution repels its neighbours. P has blown up where its largest
    entry is 10⁶ times that at the start.

    Args:
        plant: n states, m controls.
        state: x(0), (n,).
        horizon: how far to go.
        q: Q ≥ 0; a number, its diagonal (n,), or (n, n).
        r: R > 0; a number, its diagonal (m,), or (m, m).

    Raises:
        ArgumentError: a weight has a wrong shape or sign.
    """
    n, m = plant.n_states, plant.n_controls
    cost, control = weight("q", q, n), weight("r", r, m, definite=True)
    motion = MethodOfSteps().solve(ClosedLoop(plant), state, horizon)

    def rates(t: float, y: Floats) -> Floats:
        a, b = _matrices(plant, motion([min(t, horizon)])[0], t)
        p = y.reshape(n, n)
        rate: Floats = p @ b @ np.linalg.solve(control, b.T @ p) - a.T @ p - p @ a - cost
        return rate.ravel()

    start = regulator(*_matrices(plant, state, 0.0), cost, control)[1]

    def room(t: float, y: Floats) -> float:
        del t
        return math.log(_BLOWN_UP * np.abs(start).max() / np.abs(y).max())

    room.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(rates, (0.0, horizon), start.ravel(), method="LSODA", rtol=1e-9, atol=1e-12, events=room)
    return math.inf if run.status == 0 else float(run.t[-1])


def _matrices(plant: StatePlant, state: ArrayLike, time: float) -> tuple[Floats, Floats]:
    x = finite("state", state)
    if x.shape != (plant.n_states,):
        raise ArgumentError("state", f"of shape {x.shape}", f"must have shape ({plant.n_states},)")
    a, b = plant.jacobians(np.array([float(time)]), x[None], np.zeros((1, plant.n_controls)))
    return a[0], b[0]


def _along(window: Window, times: Floats) -> tuple[Floats, Floats]:
    """Return A, (b, p, s, n, n), and B, (b, p, s, n, m), at times (b, p, s) of a window."""
    count = times.size
    states = window.states(times.reshape(len(times), -1))
    n, m = window.plant.n_states, window.plant.n_controls
    with np.errstate(all="ignore"):
        a, b = window.plant.jacobians(times.ravel(), states.reshape(count, n), np.zeros((count, m)))
    return a.reshape(*times.shape, n, n), b.reshape(*times.shape, n, m)
