"""Stability and margins of a loop whose controller is sampled."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from fracctl.arrays import Array, Complexes, Floats
from fracctl.errors import UnsupportedError
from fracctl.plants.linear import LinearPlant
from fracctl.plants.state import StatePlant
from fracctl.sampled.controller import DiscreteController
from fracctl.sampled.propagation import held
from fracctl.stability.margins import Margins, of_response

_LOWEST, _PER_DECADE = 1e-5, 48
"""Lower end of the grid, over the plant's unit of frequency and the Nyquist frequency, and its density."""
_NEAR = np.concatenate([side * 10.0 ** np.arange(-6.0, -1.0, 0.5) for side in (-1.0, 1.0)])
_DOUBLINGS = 50
"""2^50 periods: a pole as near to the unit circle as numbers allow."""
_MOST_STATES = 1500
"""Of a loop whose poles are computed."""


class SampledResponse:
    """The frequency response of a sampled loop, with the plant exact under the hold.

        x_{k+1} = Φ x_k + Γ_0 u_{k-d} + Γ_1 u_{k-d-1},    L(z) = -C(z) (z I - Φ)⁻¹ Γ(z),    Γ = Γ_0 z^-d + Γ_1 z^-(d+1)

    at z = exp(iωT_s) up to the Nyquist frequency, as the pair (-C adj(z I - Φ) Γ(z), det(z I - Φ) I), which is finite
    at the poles of the plant.

    Args:
        plant: linear.
        controller: of it.

    Raises:
        UnsupportedError: the plant is not linear.
    """

    def __init__(self, plant: StatePlant, controller: DiscreteController) -> None:
        if not isinstance(plant, LinearPlant):
            raise UnsupportedError(f"the margins of a sampled loop need a linear plant, which {plant} is not")
        self.controller, self.controls = controller, plant.n_controls
        self.transition, _ = held(plant, controller.period)
        self.whole, late = divmod(controller.delay, 1.0)
        rest, self.present = held(plant, (1.0 - late) * controller.period)
        self.past = rest @ held(plant, late * controller.period)[1]
        self.nyquist = np.pi / controller.period
        self.ends: tuple[float, ...] = (_LOWEST, self.nyquist)

    def __call__(self, omega: Floats, rows: Array) -> tuple[Complexes, Complexes]:
        """Return both matrices at frequencies (1, k) or (n, k), (n, k, m, m) each."""
        phase = np.broadcast_to(omega, (rows.size, omega.shape[1])) * self.controller.period
        z = np.exp(1j * phase.ravel())
        adjugate, determinant = resolvent(self.transition, np.expm1(1j * phase.ravel()))
        late = z[:, None, None] ** -self.whole
        entering = late * (self.present + self.past / z[:, None, None])
        control = -self.controller.response(phase.ravel()) @ (adjugate @ entering)
        shape = (*phase.shape, self.controls, self.controls)
        return control.reshape(shape), (determinant[:, None, None] * np.eye(self.controls)).reshape(shape)

    def grid(self) -> Floats:
        """Return frequencies up to Nyquist's, close around the plant's resonances."""
        heights = np.abs(np.angle(np.linalg.eigvals(self.transition))) / self.controller.period
        heights = heights[heights > 1e-3]  # double poles at 0 are that far from it by rounding
        decades = np.log10(self.nyquist / _LOWEST)
        even = np.logspace(np.log10(_LOWEST), np.log10(self.nyquist), 1 + int(_PER_DECADE * decades))
        near = (heights[:, None] * (1.0 + _NEAR)).ravel()
        return np.unique(np.concatenate([even, near[near < self.nyquist]]))


def resolvent(transition: Floats, w: Complexes) -> tuple[Complexes, Complexes]:
    """Return adj(w I - A) and det(w I - A) of A = Φ - I at w = z - 1 (k,), (k, n, n) and (k,).

    By Faddeev and LeVerrier's recursion. For short periods all eigenvalues of Φ are next to 1, and z itself would lose
    what is left of the determinant.
    """
    n = len(transition)
    identity, matrix = np.eye(n), transition - np.eye(n)
    power = np.eye(n)
    adjugate: Complexes = np.zeros((len(w), n, n), dtype=np.complex128)
    determinant: Complexes = np.ones(len(w), dtype=np.complex128)
    for k in range(1, n + 1):
        adjugate = adjugate * w[:, None, None] + power
        product = matrix @ power
        coefficient = -np.trace(product) / k
        determinant = determinant * w + coefficient
        power = product + coefficient * identity
    return adjugate, determinant


def closed_loop(plant: StatePlant, controller: DiscreteController) -> Floats:
    """Return the matrix that takes [x, controller's state, controls on their way] on by a period.

    Raises:
        UnsupportedError: the plant is not linear, or the loop has more states than its poles can be computed of.
    """
    loop = SampledResponse(plant, controller)
    n, q, m = len(loop.transition), controller.n_states, controller.n_controls
    waiting = int(loop.whole) + bool(loop.past.any())
    size = n + q + m * waiting
    if size > _MOST_STATES:
        raise UnsupportedError(f"a sampled loop of {size} states; margins are for {_MOST_STATES} at most")
    matrix, demand = np.zeros((size, size)), np.zeros((m, size))
    demand[:, :n], demand[:, n : n + q] = controller.d, controller.c
    queue = [demand] + [np.eye(m, size, n + q + m * i) for i in range(waiting)]
    matrix[:n, :n] = loop.transition
    matrix[:n] += loop.present @ queue[int(loop.whole)]
    if loop.past.any():
        matrix[:n] += loop.past @ queue[int(loop.whole) + 1]
    matrix[n : n + q, :n], matrix[n : n + q, n : n + q] = controller.b, controller.a.toarray()
    for i in range(waiting):
        matrix[n + q + m * i : n + q + m * (i + 1)] = queue[i]
    return matrix


def sampled_margins(plant: StatePlant, controller: DiscreteController) -> Margins:
    """Return the margins of a sampled loop, numbers as `fracctl.stability.margins` has them for a continuous one.

    Args:
        plant: linear.
        controller: of it.

    Raises:
        UnsupportedError: the plant is not linear, or the loop has more states than its poles can be computed of.
    """
    matrix = closed_loop(plant, controller)
    stable = bool(np.abs(np.linalg.eigvals(matrix)).max() < 1.0)
    found: dict[str, Any] = {field.name: np.nan for field in fields(Margins)} | {"stable": stable}
    if not stable:
        return Margins(**found)
    response = SampledResponse(plant, controller)
    values = of_response(response, np.zeros(1, dtype=int), response.grid())
    found |= {name: float(column[0]) for name, column in values.items()}
    if plant.scales is not None:
        found["delay_margin_s"] = found["delay_margin"] * plant.scales.time_s
    return Margins(**found)


def noise_rms(
    plant: StatePlant, controller: DiscreteController, position_noise: float, velocity_noise: float
) -> tuple[Floats, Floats]:
    """Return the rms of positions and of controls, (m,) each, that white noise of every measurement keeps up.

    From the discrete Lyapunov equation P = F P Fᵀ + G Q Gᵀ of the closed loop; without limits of the thrusters.

    Args:
        plant: linear.
        controller: of it.
        position_noise: rms of the noise of each position.
        velocity_noise: rms of the noise of each velocity.

    Raises:
        UnsupportedError: the plant is not linear, or the loop not stable.
    """
    loop, matrix = SampledResponse(plant, controller), closed_loop(plant, controller)
    n, q, m = len(loop.transition), controller.n_states, controller.n_controls
    entering = np.zeros((len(matrix), 2 * m))
    entering[n : n + q] = controller.b
    if len(matrix) > n + q:
        entering[n + q : n + q + m] = controller.d
    if not loop.whole:
        entering[:n] = loop.present @ controller.d
    noise = np.diag(np.repeat([position_noise, velocity_noise], m) ** 2)
    spread = _kept_up(matrix, entering @ noise @ entering.T)
    demand = np.concatenate([controller.d, controller.c, np.zeros((m, len(matrix) - n - q))], axis=1)
    control = demand @ spread @ demand.T + controller.d @ noise @ controller.d.T
    return np.sqrt(np.diag(spread)[:m]), np.sqrt(np.diag(control))


def _kept_up(matrix: Floats, entering: Floats) -> Floats:
    """Return P = F P Fᵀ + Q as Σ_k F^k Q F^kᵀ by doubling: every sum is one of positive parts."""
    spread, power = entering, matrix
    for _ in range(_DOUBLINGS):
        with np.errstate(all="ignore"):
            added = power @ spread @ power.T
        if not np.isfinite(added).all():
            break
        spread, power = spread + added, power @ power
        if np.abs(added).max() <= 1e-15 * np.abs(spread).max():
            return spread
    raise UnsupportedError("noise has no rms in a loop that is not stable")
