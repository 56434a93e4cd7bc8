"""A fractional sliding mode of tension alone, reconstructed from what a paper says about it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, batch_size
from fracctl.compiling import DEMAND, pointer_with
from fracctl.controllers.layout import filled, in_range
from fracctl.controllers.memory import Reference
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.references import Approach
from fracctl.controllers.sliding_mode import REFERENCE_PARAMETERS, approach_of
from fracctl.errors import UnsupportedError
from fracctl.plants.capabilities import TensionedPlant
from fracctl.plants.state import StatePlant


class FractionalSlidingMode:
    """FO-SMC (reconstruction): tension alone, designed on the planar motion in a circular orbit.

        s₁ = λ' + c₁Δλ + b₁ D^ν Δλ,    s₂ = θ' + c₂θ,    S = s₁ + κ s₂,    S' = -kS - η sat(S/ε)

    Zhong et al. compare their law with one of Kang, Zhu, Wang, Li and Wang (Adv. Space Res. 59, 2017) that they do not
    print. This is a law of that kind, not that law: the design model gives the tension,

        τ_t = ρ - λ[(θ' + 1)² + 3 cos²θ - 1] - c₁λ' - κ(θ'' + c₂θ') - kS - η sat(S/ε),
        θ'' = -2 (λ'/λ)(θ' + 1) - 3 sin θ cos θ

    and no torque is used. κ must be negative for the pitch to be damped. The rate of D^ν Δλ, which is singular at the
    start, is left to the reaching law.

    Args:
        c_1: c₁, as all others () or (b,).
        b_1: b₁.
        nu: ν in (0, 1).
        c_2: c₂.
        kappa: κ.
        k: k > 0.
        eta: η ≥ 0.
        boundary_layer: ε > 0.
        caputo: 1 for the derivative of Caputo, 0 for that of Riemann and Liouville.
        reference: q_d; None for (1, 0, 0).

    Raises:
        ArgumentError: a number is out of its range.
    """

    def __init__(
        self,
        c_1: ArrayLike = 1.0,
        b_1: ArrayLike = 0.5,
        nu: ArrayLike = 0.5,
        c_2: ArrayLike = 1.0,
        kappa: ArrayLike = -0.4,
        k: ArrayLike = 1.0,
        eta: ArrayLike = 0.1,
        boundary_layer: ArrayLike = 0.05,
        caputo: ArrayLike = 0.0,
        reference: Reference | None = None,
    ) -> None:
        given = (c_1, b_1, nu, c_2, kappa, k, eta, boundary_layer, caputo)
        names = [parameter.name for parameter in _PARAMETERS]
        self._values = in_range(_PARAMETERS, dict(zip(names, given, strict=True)))
        self._reference = reference or Approach()
        wanted, _ = self._reference(np.zeros(1))
        self.batch = batch_size(**{name: (value, 0) for name, value in self._values.items()}, reference=(wanted, 2))

    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        """Return the numbers of the law, and the target of the length."""
        del components
        return (*_PARAMETERS, *REFERENCE_PARAMETERS)

    @classmethod
    def from_parameters(cls, components: Sequence[str], values: Mapping[str, ArrayLike]) -> FractionalSlidingMode:
        """Build the law from numbers or arrays (b,) by parameter name; missing ones take their defaults."""
        table = filled(cls.parameters(components), values)
        own = {parameter.name: table[parameter.name] for parameter in _PARAMETERS}
        return cls(**own, reference=approach_of(table, len(components)))

    def numbers(self, plant: StatePlant, batch: int) -> Floats:
        """Return the numbers of the law and ρ of the tether, (b, 8).

        Raises:
            UnsupportedError: the plant is no tether.
        """
        if not isinstance(plant, TensionedPlant):
            raise UnsupportedError(f"FractionalSlidingMode is a law for a tether, not for {type(plant).__name__}")
        names = ("c_1", "b_1", "c_2", "kappa", "k", "eta", "boundary_layer")
        values = [*(self._values[name] for name in names), np.array(plant.rho)]
        return np.stack([np.broadcast_to(value, (batch,)) for value in values], axis=1)

    def orders(self, n_controls: int, batch: int) -> Floats:
        """Return ν for each component, (b, m)."""
        return np.array(np.broadcast_to(self._values["nu"].reshape(-1, 1), (batch, n_controls)))

    def initial_memory(self, error: Floats) -> Floats:
        """Return what the memory begins with, (b, m)."""
        begins: Floats = (1.0 - self._values["caputo"].reshape(-1, 1)) * error
        return begins

    def initial_auxiliary(self, batch: int) -> Floats:
        """Return nothing, (b, 0)."""
        return np.zeros((batch, 0))

    def reference(self, times: Floats) -> tuple[Floats, Floats]:
        """Return q_d and q_d' at times (t,), each (t, m) or (b, t, m)."""
        return self._reference(times)

    @property
    def demand(self) -> Any:
        """The law as a compiled function."""
        return _demand


_PARAMETERS = (
    Parameter("c_1", 1.0, lower=0.0),
    Parameter("b_1", 0.5, lower=0.0),
    Parameter("nu", 0.5, lower=0.0, upper=1.0, lower_allowed=False, upper_allowed=False, kind="order"),
    Parameter("c_2", 1.0),
    Parameter("kappa", -0.4),
    Parameter("k", 1.0, lower=0.0, lower_allowed=False),
    Parameter("eta", 0.1, lower=0.0),
    Parameter("boundary_layer", 0.05, lower=0.0, lower_allowed=False),
    Parameter("caputo", 0.0, lower=0.0, upper=1.0),
)


@pointer_with(DEMAND)
def _demand(
    t: float,  # noqa: ARG001
    q: Floats,
    rate: Floats,
    error: Floats,
    error_rate: Floats,
    fractional: Floats,
    c: float,  # noqa: ARG001
    base: Floats,  # noqa: ARG001
    peaks: Floats,  # noqa: ARG001
    law: Floats,
    z: Floats,  # noqa: ARG001
    w: Floats,
) -> None:
    c_1, b_1, c_2, kappa, k, eta, layer, mean = law[0], law[1], law[2], law[3], law[4], law[5], law[6], law[7]
    turn, cosine = rate[1] + 1.0, math.cos(q[1])
    pitch = -2.0 * rate[0] / q[0] * turn - 3.0 * math.sin(q[1]) * cosine
    surface = error_rate[0] + c_1 * error[0] + b_1 * fractional[0] + kappa * (rate[1] + c_2 * q[1])
    reach = k * surface + eta * min(max(surface / layer, -1.0), 1.0)
    pull = q[0] * (turn * turn + 3.0 * cosine * cosine - 1.0)
    w[0] = mean - pull - c_1 * error_rate[0] - kappa * (pitch + c_2 * rate[1]) - reach
    for i in range(1, len(w)):
        w[i] = 0.0
