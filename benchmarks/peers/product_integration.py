"""pycaputo: implicit product integration of the trapezoidal type (Garrappa 2015) on a graded mesh.

The loop as a system of Caputo equations of orders 1, 1 - α, 1:

    D ξ = ζ,    D^(1-α) η = ζ,    D ζ = (S - K_P) ξ - K_D η + D ζ,        η = D^α ξ, ζ = ξ'

pycaputo's own root finder is replaced by a linear solve, as its documentation advises where one is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pycaputo.controller import Controller, make_graded_controller
from pycaputo.derivatives import CaputoDerivative
from pycaputo.events import StepAccepted
from pycaputo.fode.caputo import Trapezoidal
from pycaputo.stepping import evolve
from pycaputo.typing import Array

from benchmarks.peers.base import Solution
from tests.references.loops import Floats, Loop

GRADING = 2.0
"""r of the mesh (n/N)^r; restores the second order of the rule here, 3 gains nothing more."""


@dataclass(frozen=True)
class _LinearTrapezoidal(Trapezoidal[Any]):
    """The method for D^β y = A y, with A in equal blocks (B, n, n)."""

    blocks: Floats

    def solve(self, t: float, y0: Array, c: Array, r: Array) -> Array:  # noqa: ARG002 - pycaputo's signature
        """Solve y = c A y + r."""
        count, n, _ = self.blocks.shape
        matrix = np.eye(n) - c.reshape(count, n, 1) * self.blocks
        return np.asarray(np.linalg.solve(matrix, r.reshape(count, n, 1)).ravel())


@dataclass(frozen=True)
class ProductIntegration:
    """N steps; several loops are stacked into one system, which spreads the cost of the interpreter."""

    steps: int
    loops: int = 1
    own_root_finder: bool = False
    """Whether to leave pycaputo its root finder, with the Jacobian given."""
    package = "pycaputo"
    method = "implicit product integration"

    @property
    def ladder(self) -> bool:
        """Whether the setting is one of several that trade time for accuracy."""
        return not self.own_root_finder

    @property
    def setting(self) -> str:
        """The setting in words."""
        notes = [f"{self.loops} loops stacked"] if self.loops > 1 else []
        notes += ["its own root finder"] if self.own_root_finder else []
        return ", ".join([f"N = {self.steps}, graded", *notes])

    def __call__(self, loops: Sequence[Loop], horizon: float) -> list[Solution]:
        """Solve loops with equal orders on [0, horizon]."""
        blocks = np.stack([system_matrix(loop) for loop in loops])
        start = np.concatenate([np.concatenate([loop.value, np.zeros(loop.size), loop.rate]) for loop in loops])
        control = make_graded_controller(0.0, horizon, self.steps, r=GRADING)
        method = self._method(blocks, [order for loop in loops for order in orders(loop)], start, control)
        accepted = [event for event in evolve(method, dtinit=control.dtinit) if isinstance(event, StepAccepted)]
        times = np.array([event.t for event in accepted])[1:]
        states = np.array([event.y for event in accepted])[1:].reshape(len(times), len(loops), -1)
        return [_solution(loop, times, states[:, i]) for i, loop in enumerate(loops)]

    def _method(
        self, blocks: Floats, system_orders: list[float], start: Floats, control: Controller
    ) -> Trapezoidal[Any]:
        count, n, _ = blocks.shape
        derivatives = tuple(CaputoDerivative(order) for order in system_orders)

        def source(_: float, y: Floats) -> Floats:
            product: Floats = (blocks @ y.reshape(count, n, 1)).ravel()
            return product

        if self.own_root_finder:
            return Trapezoidal(derivatives, control, source, (start,), lambda _, __: blocks[0])
        return _LinearTrapezoidal(derivatives, control, source, (start,), None, blocks)


def orders(loop: Loop) -> list[float]:
    """Return the orders of the equations for ξ, D^α ξ, ξ'."""
    return [1.0] * loop.size + [1.0 - order for order in loop.alpha] + [1.0] * loop.size


def system_matrix(loop: Loop) -> Floats:
    """Return A of D^β y = A y for y = [ξ, D^α ξ, ξ'] (orders α below 1)."""
    zero, one = np.zeros((loop.size, loop.size)), np.eye(loop.size)
    return np.block([[zero, zero, one], [zero, zero, one], [loop.stiffness - loop.k_p, -loop.k_d, loop.damping]])


def _solution(loop: Loop, times: Floats, states: Floats) -> Solution:
    position, derivative, _ = np.split(states, 3, axis=1)
    return Solution(times, position, -position @ loop.k_p.T - derivative @ loop.k_d.T)
