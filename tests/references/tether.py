"""The tether under sliding modes as one stiff ODE for SciPy: the reference of the closed loop.

    y = [λ, θ, φ, λ', θ', φ', ∫S_q1 (3), ϑ (2), M (3), ψ]

ϑ follow the raw equations (38), with ϑ₂ in the second exponent; M is the largest |∫S_q1| so far, but at least 1/γ₀,
for (41). The fractional derivative of Δq is Σ w ψ with ψ' = -sψ + Δq', and ψ(0) = Δq(0) for Riemann and Liouville,
0 for Caputo. Nodes s and weights w are those of Gauss and Jacobi below 0.1, and of Gauss and Legendre in log s for each
power of ten above.

Origin: Zhong, Shao, Li, Ma, Sun, Eqs. 5 and 36 to 41, corrected. Tolerance: that asked of SciPy, and 6e-8 for the
kernel from f = 1e-6 on. Checked by LSODA against BDF and Radau, and by its parts, in tests/references/test_tether.py.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray
Goal = Callable[[float], tuple[Array, Array]]
ORBIT = 2.0 * math.pi
RHO = 2.55
SHORTEST = 1e-4
_INTEGRAL, _THETA, _LARGEST, _MEMORY = slice(6, 9), slice(9, 11), slice(11, 14), 14


def modes(order: float, fastest: float = 1e8, in_block: int = 8) -> tuple[Array, Array]:
    """Return s and w with t^(-order)/Γ(1 - order) = Σ w e^(-s t)."""
    node, weight = gauss_jacobi(in_block, order - 1.0)
    s, w = [0.1 * node], [0.1**order * weight]
    node, weight = np.polynomial.legendre.leggauss(in_block)
    for block in range(-1, round(math.log10(fastest))):
        s.append(10.0 ** (block + 0.5 * (1.0 + node)))
        w.append(0.5 * math.log(10.0) * weight * s[-1] ** order)
    return np.concatenate(s), np.concatenate(w) * math.sin(math.pi * order) / math.pi


def gauss_jacobi(count: int, power: float) -> tuple[Array, Array]:
    """Return nodes and weights on [0, 1] for the weight x^power, from the recurrence of the Jacobi polynomials."""
    n = np.arange(1, count)
    diagonal = np.concatenate([[power / (power + 2.0)], power**2 / ((2 * n + power) * (2 * n + power + 2))])
    beside = np.sqrt(4.0 * n**2 * (n + power) ** 2 / ((2 * n + power) ** 2 * ((2 * n + power) ** 2 - 1.0)))
    node, vectors = np.linalg.eigh(np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1))
    return 0.5 * (1.0 + node), vectors[0] ** 2 / (power + 1.0)


def accelerations(f: float, q: Array, v: Array, u: Array, e: float, disturbance: Array, phase: float) -> Array:
    """ξ'' of q, v and u, (3, k) each, term by term as in the equations."""
    (length, theta, phi), (length_1, theta_1, phi_1) = q, v
    k = 1.0 + e * math.cos(f)
    b, turn = 2.0 * e * math.sin(f) / k, theta_1 + 1.0
    force = u + (np.asarray(disturbance) * math.sin(f + phase))[:, None]
    first = force[0] - RHO + b * length_1 + length * (phi_1**2 + turn**2 * np.cos(phi) ** 2)
    first = first - length / k * (1.0 - 3.0 * np.cos(theta) ** 2 * np.cos(phi) ** 2)
    second = force[1] / (length**2 * np.cos(phi) ** 2) + b * turn - 2.0 * length_1 / length * turn
    second = second + 2.0 * np.tan(phi) * phi_1 * turn - 3.0 / k * np.sin(theta) * np.cos(theta)
    third = force[2] / length**2 + b * phi_1 - 2.0 * length_1 / length * phi_1
    third = third - (turn**2 + 3.0 / k * np.cos(theta) ** 2) * np.sin(phi) * np.cos(phi)
    return np.stack([first, second, third])


@dataclass(frozen=True)
class SlidingMode:
    """FDA-SMC; α₁ = 0 is DA-SMC."""

    alpha_1: float = 0.5
    alpha_0: float = 1.75
    order: float = 0.5
    caputo: bool = False
    gamma_0: Sequence[float] = (1.2, 3.0, 0.9)
    c: float = 0.9
    zeta: float = 3.0
    phi: Sequence[float] = (2.0, 0.0054)
    k_1: float = 0.05
    theta_0: float = 1.0
    layer: float = 0.05
    limits: Sequence[float] = (2.45, 5.0, 5.0)

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        return modes(self.order) if self.alpha_1 else (np.zeros(0), np.zeros(0))

    def begin(self, error: Array) -> Array:
        """The law's states at the start, for Δq there."""
        memory = np.tile(0.0 * error if self.caputo else error, len(self.modes[0]))
        return np.concatenate([np.zeros(3), [self.theta_0, self.theta_0], self.largest_allowed, memory])

    @property
    def largest_allowed(self) -> Array:
        """1/γ₀, from which on the largest |∫S_q1| counts."""
        return 1.0 / np.maximum(self.gamma_0, 1e-9)

    def adaptation(self, theta: Array) -> Array:
        """ϑ' of (38) over the sums of |S_r2| and S_r2², (2, k)."""
        gains, power = self.zeta * np.array(self.phi)[:, None] * self.k_1, 1.0 / (self.k_1 * theta)
        return gains * np.exp(-2.0 * power) - np.exp(power) * (self.k_1 * theta - 1.0)

    def __call__(self, y: Array, error: Array, error_rate: Array) -> tuple[Array, Array]:
        """Return the controls (3, k) and the rates of the law's states, for columns y."""
        s, w = self.modes
        psi = y[_MEMORY:].reshape(len(s), 3, y.shape[1])
        surface = error_rate + self.alpha_0 * error + self.alpha_1 * np.tensordot(w, psi, 1)
        quasi = np.sin(np.clip(surface, -np.pi / 2.0, np.pi / 2.0))
        total, theta, largest = y[_INTEGRAL], y[_THETA], y[_LARGEST]
        beyond = largest > self.largest_allowed[:, None] * (1.0 + 1e-9)
        gamma = np.where(beyond, self.c / largest, np.array(self.gamma_0)[:, None])
        inner = np.clip(gamma * total, -1.0, 1.0)
        first, second = quasi + inner, surface + np.arcsin(inner)
        demand = self.zeta * self.phi[0] * theta[0] * np.clip(first / self.layer, -1.0, 1.0)
        demand = demand + self.zeta * self.phi[1] * theta[1] * second
        adapts = self.adaptation(theta) * np.stack([np.abs(second).sum(0), (second**2).sum(0)])
        grows = np.where(np.abs(total) >= largest * (1.0 - 1e-6), np.maximum(np.sign(total) * quasi, 0.0), 0.0)
        memory = (error_rate - s[:, None, None] * psi).reshape(-1, y.shape[1])
        limits = np.array(self.limits)[:, None]
        return np.clip(-demand, -limits, limits), np.concatenate([quasi, adapts, grows, memory])


@dataclass(frozen=True)
class Tension:
    """FO-SMC (reconstruction): tension alone, from a planar circular design model.

    s₁ = λ' + c₁Δλ + b₁D^½Δλ, s₂ = θ' + c₂θ, S = s₁ + κs₂. The equivalent control makes the derivative of
    λ' + c₁Δλ + κs₂ zero in the model: that of D^½Δλ, of order 3/2, is left out, for it begins as t^(-3/2).
    """

    c_1: float = 1.0
    b_1: float = 0.5
    c_2: float = 1.0
    kappa: float = -0.4
    gain: float = 1.0
    switch: float = 0.1
    layer: float = 0.05
    limit: float = 2.45

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        return modes(0.5)

    def begin(self, error: Array) -> Array:
        """The law's states at the start, for Δq there; the first eight are not used."""
        return np.concatenate([np.zeros(8), np.full(len(self.modes[0]), error[0])])

    def __call__(self, y: Array, error: Array, error_rate: Array) -> tuple[Array, Array]:
        """Return the controls (3, k) and the rates of the law's states, for columns y."""
        s, w = self.modes
        length, theta, length_1, theta_1 = y[0], y[1], y[3], y[4]
        surface = error_rate[0] + self.c_1 * error[0] + self.b_1 * (w @ y[_MEMORY:])
        surface = surface + self.kappa * (theta_1 + self.c_2 * theta)
        theta_2 = -2.0 * length_1 / length * (theta_1 + 1.0) - 3.0 * np.sin(theta) * np.cos(theta)
        drift = length * (theta_1 + 1.0) ** 2 - length * (1.0 - 3.0 * np.cos(theta) ** 2) - RHO
        control = -drift - self.c_1 * error_rate[0] - self.kappa * (theta_2 + self.c_2 * theta_1)
        control = control - self.gain * surface - self.switch * np.clip(surface / self.layer, -1.0, 1.0)
        control = np.clip(control, -self.limit, self.limit)
        memory = error_rate[0] - s[:, None] * y[_MEMORY:]
        return np.stack([control, 0.0 * control, 0.0 * control]), np.concatenate([np.zeros((8, y.shape[1])), memory])


@dataclass(frozen=True)
class Run:
    """What SciPy returned."""

    f: Array
    """True anomalies, (k,); they end early where λ fell to `SHORTEST`."""
    y: Array
    """States without ψ, (14, k)."""
    u: Array
    """Controls, (3, k)."""
    cpu_s: float

    def settling(self, band: float, component: int = 0, goal: float = 1.0) -> float:
        """Where a position enters the band for good, in f/2π; NaN where it ends outside."""
        away = np.abs(self.y[component] - goal)
        outside = np.flatnonzero(away > band)
        if not len(outside):
            return 0.0
        i = int(outside[-1])
        if i == len(away) - 1:
            return math.nan
        return float(self.f[i] + (away[i] - band) / (away[i] - away[i + 1]) * (self.f[i + 1] - self.f[i])) / ORBIT

    @property
    def first_negative_rate(self) -> float:
        """Where λ' becomes negative, in f/2π; NaN where it does not."""
        below = np.flatnonzero(self.y[3] < 0.0)
        return float(self.f[below[0]]) / ORBIT if len(below) else math.nan

    @property
    def tension(self) -> Array:
        """ρ - τ_t, (k,)."""
        return RHO - self.u[0]


def grid(horizon: float, points: int = 4000) -> Array:
    """True anomalies, dense enough for the measures of a run."""
    return np.concatenate([[0.0], np.geomspace(1e-6, 1e-2, 200), np.linspace(1e-2, horizon, points)[1:]])


def deployed(f: float) -> tuple[Array, Array]:
    """The goal at full length: q_d and its derivative."""
    return np.array([1.0, 0.0, 0.0]), np.zeros(3)


def retrieved(length: float, rate: float) -> Goal:
    """The goal λ_d = length + (1 - length) e^(-rate f)."""
    none = np.zeros(2)

    def goal(f: float) -> tuple[Array, Array]:
        rest = (1.0 - length) * math.exp(-rate * f)
        return np.array([length + rest, *none]), np.array([-rate * rest, *none])

    return goal


def solve(
    law: SlidingMode | Tension,
    start: Sequence[float],
    times: Array,
    e: float = 0.0027,
    disturbance: Sequence[float] = (0.05, 0.05, 0.05),
    phase: float = 0.0,
    goal: Goal = deployed,
    method: str = "BDF",
    rtol: float = 1e-6,
    atol: float = 1e-9,
) -> Run:
    """Solve from perigee for the states at `times`, which begin with 0."""

    def controlled(f: float, y: Array) -> tuple[Array, Array]:
        place, speed = goal(f)
        return law(y, y[:3] - place[:, None], y[3:6] - speed[:, None])

    def rates(f: float, y: Array) -> Array:
        columns = y.reshape(len(y), -1)
        u, law_rates = controlled(f, columns)
        second = accelerations(f, columns[:3], columns[3:6], u, e, np.asarray(disturbance), phase)
        return np.concatenate([columns[3:6], second, law_rates]).reshape(y.shape)

    def jacobian(f: float, y: Array) -> Array:
        step = 1e-7 * np.maximum(np.abs(y), 1e-4)
        step[0] = 1e-7 * y[0]
        return (rates(f, y[:, None] + np.diag(step)) - rates(f, y[:, None] - np.diag(step))) / (2.0 * step)

    def shortest(f: float, y: Array) -> float:
        return float(y[0]) - SHORTEST

    shortest.terminal = True
    initial = np.concatenate([start, law.begin(np.asarray(start)[:3] - goal(0.0)[0])])
    begun = time.process_time()
    options = {"rtol": rtol, "atol": atol, "jac": jacobian, "events": shortest}
    done = solve_ivp(rates, (0.0, times[-1]), initial, method, times, **options)
    cost = time.process_time() - begun
    assert done.success, done.message
    u = [controlled(f, y[:, None])[0][:, 0] for f, y in zip(done.t, done.y.T, strict=True)]
    return Run(done.t, done.y[:_MEMORY], np.stack(u, axis=1), cost)
