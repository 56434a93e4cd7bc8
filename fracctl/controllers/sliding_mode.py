"""Adaptive sliding mode control with a fractional term in its surface."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicHermiteSpline

from fracctl.arrays import Floats, batch_size, finite
from fracctl.compiling import DEMAND, helper_with, pointer_with
from fracctl.controllers.adaptation import NODES, adaptation_table, looked_up
from fracctl.controllers.layout import component_vector, filled, in_range
from fracctl.controllers.memory import Reference
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.references import Approach
from fracctl.errors import ArgumentError
from fracctl.plants.state import StatePlant

_exact = helper_with(error_model="numpy")
_HEAD = 7
"""Numbers before γ₀ and the tables."""


class AdaptiveSlidingMode:
    """The law of Zhong, Shao, Li, Ma and Sun, Eqs 36-41: FDA-SMC, and with α₁ = 0 DA-SMC.

        w = -(ζφ₁ϑ₁ sat(S_r1/ε) + ζφ₂ϑ₂ S_r2),    componentwise, with
        x = Δq' + α₀Δq + α₁ D^ν Δq,    S_q1 = Qsat(x),    I' = S_q1,    S_r1 = S_q1 + γI,    S_r2 = x + arcsin γI

    Qsat(x) is sin x for |x| < π/2 and the sign of x beyond. γ = γ₀ while γ₀ max|I| ≤ 1 and c/max|I| afterwards. ϑ₁ and
    ϑ₂ follow Eq. 38, whose second line wants ϑ₂ in its exponent, see `fracctl.controllers.adaptation`. The sign of
    Eq. 36 is softened in a boundary layer ε.

    Args:
        alpha_0: α₀ > 0, as all others () or (b,).
        alpha_1: α₁; 0 for DA-SMC.
        nu: ν in (0, 1).
        zeta: ζ > 1.
        phi_1: φ₁, bound of the uncertainty.
        phi_2: φ₂, bound of the orbit's term, 2e/(1 - e).
        k_1: K₁ of the adaptation.
        gamma: γ₀ of the m components, (m,) or (b, m).
        shrink: c in (0, 1].
        boundary_layer: ε > 0, which the paper does not print.
        vartheta_0: ϑ₁(0) = ϑ₂(0) > 0, which it does not print either.
        caputo: 0 for the derivative of Riemann and Liouville from the start of the manoeuvre (Definition 4 of the
            paper), 1 for that of Caputo.
        reference: q_d; None for (1, 0, …, 0). A function of times (t,) that returns q_d and q_d', each (t, m) or
            (b, t, m).

    Raises:
        ArgumentError: a number is out of its range or has a wrong shape.
    """

    def __init__(
        self,
        alpha_0: ArrayLike = 1.75,
        alpha_1: ArrayLike = 0.5,
        nu: ArrayLike = 0.5,
        zeta: ArrayLike = 3.0,
        phi_1: ArrayLike = 2.0,
        phi_2: ArrayLike = 0.0054,
        k_1: ArrayLike = 0.05,
        gamma: ArrayLike = (1.2, 3.0, 0.9),
        shrink: ArrayLike = 0.9,
        boundary_layer: ArrayLike = 0.05,
        vartheta_0: ArrayLike = 1.0,
        caputo: ArrayLike = 0.0,
        reference: Reference | None = None,
    ) -> None:
        given = {
            "alpha_0": alpha_0,
            "alpha_1": alpha_1,
            "nu": nu,
            "zeta": zeta,
            "phi_1": phi_1,
            "phi_2": phi_2,
            "k_1": k_1,
            "shrink": shrink,
            "boundary_layer": boundary_layer,
            "vartheta_0": vartheta_0,
            "caputo": caputo,
        }
        self._values = in_range(_PARAMETERS, given)
        self.gamma = finite("gamma", gamma)
        if self.gamma.ndim not in (1, 2) or (self.gamma < 0.0).any():
            raise ArgumentError("gamma", self.gamma.tolist(), "must hold numbers from 0 on, (m,) or (b, m)")
        self._reference = reference or Approach(components=self.gamma.shape[-1])
        wanted, _ = self._reference(np.zeros(1))
        sizes = {name: (value, 0) for name, value in self._values.items()}
        self.batch = batch_size(**sizes, gamma=(self.gamma, 1), reference=(wanted, 2))

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return the numbers of the law, γ₀ for each component, and the target of the first component.

        ``reference_rate`` c > 0 leads it from ``reference_start`` to ``reference_target`` as e^(-ct); 0 is a step.
        """
        gammas = [
            Parameter(f"gamma_{name}", value, lower=0.0)
            for name, value in zip(components, (1.2, 3.0, 0.9), strict=False)
        ]
        return (*_PARAMETERS, *gammas, *REFERENCE_PARAMETERS)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> AdaptiveSlidingMode:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = filled(cls.parameters(components), values)
        own = {parameter.name: table[parameter.name] for parameter in _PARAMETERS}
        gamma = component_vector(table, "gamma", components)
        return cls(**own, gamma=gamma, reference=approach_of(table, len(components)))

    def numbers(self, plant: StatePlant, batch: int) -> Floats:
        """Return the numbers of the law and the tables of ϑ₁ and ϑ₂, (b, k)."""
        if self.gamma.shape[-1] != plant.n_controls:
            allowed = f"must have shape ({plant.n_controls},) or (b, {plant.n_controls}) for this plant"
            raise ArgumentError("gamma", f"of shape {self.gamma.shape}", allowed)
        names = ("alpha_0", "alpha_1", "zeta", "phi_1", "phi_2", "boundary_layer", "shrink")
        head = np.stack([np.broadcast_to(self._values[name], (batch,)) for name in names], axis=1)
        gamma = np.broadcast_to(self.gamma, (batch, plant.n_controls))
        return np.concatenate([head, gamma, self._tables("phi_1", batch), self._tables("phi_2", batch)], axis=1)

    def _tables(self, phi: str, batch: int) -> Floats:
        rate, start = self._values["k_1"], self._values["vartheta_0"]
        keys = np.broadcast_arrays(np.empty(batch), rate, self._values["zeta"] * self._values[phi], start)[1:]
        return np.stack([adaptation_table(*map(float, key)).ravel() for key in zip(*keys, strict=True)])

    def orders(self, n_controls: int, batch: int) -> Floats:
        """Return ν for each component, (b, m)."""
        nu = self._values["nu"].reshape(-1, 1)
        return np.array(np.broadcast_to(nu, (batch, n_controls)))

    def initial_memory(self, error: Floats) -> Floats:
        """Return what the memory begins with, (b, m)."""
        begins: Floats = (1.0 - self._values["caputo"].reshape(-1, 1)) * error
        return begins

    def initial_auxiliary(self, batch: int) -> Floats:
        """Return I = 0, ∫‖S_r2‖₁ = 0 and ∫‖S_r2‖² = 0, (b, m + 2)."""
        return np.zeros((batch, self.gamma.shape[-1] + 2))

    def reference(self, times: Floats) -> tuple[Floats, Floats]:
        """Return q_d and q_d' at times (t,), each (t, m) or (b, t, m)."""
        return self._reference(times)

    def adapted(self, auxiliary: Floats) -> Floats:
        """Return ϑ₁ and ϑ₂ of auxiliary states (b, …, m + 2), (b, …, 2)."""
        batch = len(auxiliary)
        out = np.empty((*auxiliary.shape[:-1], 2))
        for k, phi in enumerate(("phi_1", "phi_2")):
            tables = self._tables(phi, batch).reshape(batch, 3, NODES)
            for member, (sigma, theta, slope) in enumerate(tables):
                driven = np.minimum(auxiliary[member, ..., k - 2], sigma[-1])
                out[member, ..., k] = CubicHermiteSpline(sigma, theta, slope)(driven)
        return out

    @property
    def demand(self) -> Any:
        """The law as a compiled function."""
        return _demand


_PARAMETERS = (
    Parameter("alpha_0", 1.75, lower=0.0, lower_allowed=False),
    Parameter("alpha_1", 0.5, lower=0.0),
    Parameter("nu", 0.5, lower=0.0, upper=1.0, lower_allowed=False, upper_allowed=False, kind="order"),
    Parameter("zeta", 3.0, lower=1.0, lower_allowed=False),
    Parameter("phi_1", 2.0, lower=0.0),
    Parameter("phi_2", 0.0054, lower=0.0),
    Parameter("k_1", 0.05, lower=0.0, lower_allowed=False),
    Parameter("shrink", 0.9, lower=0.0, upper=1.0, lower_allowed=False),
    Parameter("boundary_layer", 0.05, lower=0.0, lower_allowed=False),
    Parameter("vartheta_0", 1.0, lower=0.0, lower_allowed=False),
    Parameter("caputo", 0.0, lower=0.0, upper=1.0),
)
REFERENCE_PARAMETERS = (
    Parameter("reference_target", 1.0, lower=0.0, lower_allowed=False),
    Parameter("reference_start", 1.0, lower=0.0, lower_allowed=False),
    Parameter("reference_rate", 0.0, lower=0.0),
)


def approach_of(table: Mapping[str, Floats], components: int) -> Approach:
    """Return the reference of `REFERENCE_PARAMETERS`."""
    target, start, rate = (table[parameter.name] for parameter in REFERENCE_PARAMETERS)
    return Approach(target, start, rate, components)


@_exact
def _surface(
    i: int,
    error: Floats,
    error_rate: Floats,
    fractional: Floats,
    c: float,
    base: Floats,
    peaks: Floats,
    law: Floats,
    z: Floats,
) -> tuple[float, float, float]:
    """Fill I of a component; return x, Qsat(x) and γI."""
    x = error_rate[i] + law[0] * error[i] + law[1] * fractional[i]
    soft = math.copysign(1.0, x) if abs(x) >= 0.5 * math.pi else math.sin(x)
    z[i] = base[i] + c * soft
    largest, gamma = max(peaks[i], abs(z[i])), law[_HEAD + i]
    return x, soft, gamma * z[i] if gamma * largest <= 1.0 else law[6] * z[i] / largest


@pointer_with(DEMAND)
def _demand(
    t: float,  # noqa: ARG001
    q: Floats,
    rate: Floats,  # noqa: ARG001
    error: Floats,
    error_rate: Floats,
    fractional: Floats,
    c: float,
    base: Floats,
    peaks: Floats,
    law: Floats,
    z: Floats,
    w: Floats,
) -> None:
    m = len(q)
    magnitude = square = 0.0
    for i in range(m):
        x, _, wound = _surface(i, error, error_rate, fractional, c, base, peaks, law, z)
        w[i] = x + math.asin(wound)
        magnitude += abs(w[i])
        square += w[i] * w[i]
    z[m] = base[m] + c * magnitude
    z[m + 1] = base[m + 1] + c * square
    first_gain = law[2] * law[3] * looked_up(z[m], law, _HEAD + m)
    second_gain = law[2] * law[4] * looked_up(z[m + 1], law, _HEAD + m + 3 * NODES)
    for i in range(m):
        _, soft, wound = _surface(i, error, error_rate, fractional, c, base, peaks, law, z)
        w[i] = -first_gain * min(max((soft + wound) / law[5], -1.0), 1.0) - second_gain * w[i]
