"""Every solver meets every system of its class that has a closed form, through one tester."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import mpmath
import numpy as np
import pytest
from numpy.typing import ArrayLike

from fracctl.controllers import LinearLaw, LinearLawTerms, PDAlpha, PDLag, PILambdaDMu
from fracctl.fractional.terms import FractionalTerm
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane, LinearPlant
from fracctl.solvers import Collocation, Contour, ExplicitMemory, Solver, Volterra
from tests.references import loops, series
from tests.references.laplace import Reference
from tests.references.loops import Loop
from tests.references.product import check_times, closed_loop
from tests.systems.laws import OUT_OF_PLANE, FirstOrder, filtered_pid, pid

HORIZON = 10.0
TIMES = check_times(HORIZON)
Exact = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""From times (t,) to positions (t, m) and controls (t, m)."""


@dataclass(frozen=True)
class Case:
    """A loop, its start and its exact solution; `smooth` solutions are entire functions of time."""

    name: str
    loop: ClosedLoop
    start: np.ndarray
    exact: Exact
    smooth: bool

    @cached_property
    def values(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions and controls at the times of the test."""
        return self.exact(TIMES)


@dataclass(frozen=True)
class Damper:
    """υ = -k D^α w with any order α in [-1, 2), a number or (b,)."""

    k: float
    alpha: ArrayLike

    def linear_terms(self, n_controls: int) -> LinearLawTerms:
        return LinearLawTerms((FractionalTerm(np.array([[-self.k]]), np.asarray(self.alpha, dtype=float)[..., None]),))


def companion_case(name: str, law: LinearLaw, form: FirstOrder) -> Case:
    start = np.array([1e-3, 2e-3])

    def exact(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        states = form.states(start, times)
        return states[:, :1], states @ form.output.T

    return Case(name, ClosedLoop(HCWOutOfPlane(), law), start, exact, smooth=True)


def integer_case(member: Loop) -> Case:
    def exact(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        states, controls = series.matrix_exponential(member, times)
        return states[:, : member.size], controls

    return Case(f"α = 1, {member.size}-D", closed_loop([member]), member.start, exact, smooth=True)


def free_motion(alpha: float) -> Case:
    start = np.array([1e-3, -2e-3, 5e-4, 1e-3])
    loop = ClosedLoop(HCWInPlane(), PDAlpha(np.zeros((2, 2)), np.zeros((2, 2)), alpha))

    def exact(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return series.free_in_plane(start, times)[:, :2], np.zeros((len(times), 2))

    return Case("K = 0", loop, start, exact, smooth=True)


def free_mass() -> Case:
    """w'' + k_D D^α w = 0: a Mittag-Leffler function with a pole at 0."""
    law = PDAlpha(-1.0, 1.5, 0.8)

    def exact(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w = np.array([[float(series.damped_free_mass(1.5, 0.8, 1e-3, 2e-3, t))] for t in times])
        reference = Reference(loops.out_of_plane(-1.0 + 1e-13, 1.5, 0.8, [1e-3, 2e-3]), 16)
        return w, reference(times).control

    return Case("free mass", ClosedLoop(HCWOutOfPlane(), law), np.array([1e-3, 2e-3]), exact, smooth=False)


def viscous_oscillator(alpha: float) -> Case:
    """Bagley and Torvik's form w'' + k D^α w + w = 0 from w(0) with w'(0) = 0, also for α above 1; υ = w'' + w."""

    def exact(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w = np.array([[float(series.fractional_oscillator(0.7, 1.0, alpha, 1e-3, 0.0, t))] for t in times])
        return w, np.full_like(w, np.nan)

    return Case(f"order {alpha}", ClosedLoop(HCWOutOfPlane(), Damper(0.7, alpha)), np.array([1e-3, 0.0]), exact, False)


def rotated_oscillators() -> Case:
    """Three coupled oscillators with the same orders in every column, diagonal in a rotated frame."""
    c, s = np.cos(0.7), np.sin(0.7)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    stiffness = rotation @ np.diag([-1.0, -2.0, -3.0]) @ rotation.T
    loop = ClosedLoop(LinearPlant(stiffness), PDAlpha(0.5 * np.eye(3), 0.8 * np.eye(3), 0.85))
    start = np.array([1.0, 0.5, -1.0])
    modes = rotation.T @ start

    def exact(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        parts = [Reference(loops.out_of_plane(k + 0.5, 0.8, 0.85, [1.0, 0.0]), 18)(times) for k in range(3)]
        positions = np.stack([modes[k] * parts[k].position[:, 0] for k in range(3)], axis=1)
        controls = np.stack(
            [modes[k] * (parts[k].control[:, 0] + k * parts[k].position[:, 0]) for k in range(3)], axis=1
        )
        return positions @ rotation.T, controls @ rotation.T

    return Case("3-D", loop, np.concatenate([start, np.zeros(3)]), exact, smooth=False)


IN_PLANE = [[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]]
CASES = [
    integer_case(loops.out_of_plane(0.55, 2.0, 1.0, [1e-3, 2e-3])),
    integer_case(loops.in_plane(IN_PLANE, [1.0, 1.0], [-1e-3, 0.0, 0.0, 2e-3])),
    free_motion(1.0),
    free_motion(0.6),
    free_mass(),
    viscous_oscillator(0.4),
    viscous_oscillator(1.5),
    rotated_oscillators(),
    companion_case("lag", PDLag(0.5, 2.0, 0.3), filtered_pid(*OUT_OF_PLANE, 0.5, 0.0, 2.0, 0.3)),
    companion_case("PID", PILambdaDMu(1.0, 0.7, 2.0), pid(*OUT_OF_PLANE, 1.0, 0.7, 2.0)),
]
SOLVERS: list[tuple[Solver, float, float]] = [
    (Contour(), 1e-8, 1e-8),
    (Volterra(), 1e-9, 1e-9),
    (Volterra(nodes=16), 1e-8, 1e-8),
    (ExplicitMemory(), 1e-9, 1e-9),
    (Collocation(96), 1e-9, 2e-3),
    (Collocation(96, form="first_order"), 1e-9, 2e-3),
]
"""With the errors allowed for smooth and for other solutions."""


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize(("solver", "smooth", "other"), SOLVERS)
def test_closed_forms(case: Case, solver: Solver, smooth: float, other: float) -> None:
    trajectory = solver.solve(case.loop, case.start, HORIZON)
    positions, controls = case.values
    m = positions.shape[1]
    allowed = smooth if case.smooth else other
    computed = np.reshape(trajectory(TIMES), (len(TIMES), -1))[:, :m]
    assert np.abs(computed - positions).max() < allowed * np.abs(positions).max()
    if np.isfinite(controls).all():
        difference = np.abs(np.reshape(trajectory.control(TIMES), (-1, m)) - controls).max()
        assert difference <= allowed * np.abs(controls).max()
    assert trajectory.status.item() == "ok"
    assert trajectory.error_estimate.item() <= solver.tolerance


def from_laplace(k: float, alpha: float, start: tuple[float, float], time: float) -> list[float]:
    """Return w and υ of w'' + k D^α w + w = 0 by Talbot's inversion.

    D^α w has the transform σ^α W - σ^(α-1) w(0) - σ^(α-2) w'(0), without w(0) for α ≤ 0, without w'(0) for α ≤ 1.
    """
    value, rate = start

    def transform(sigma: mpmath.mpc, which: int) -> mpmath.mpc:
        history = (value * sigma ** (alpha - 1) if alpha > 0 else 0) + (rate * sigma ** (alpha - 2) if alpha > 1 else 0)
        position = (sigma * value + rate + k * history) / (sigma**2 + k * sigma**alpha + 1)
        return (position, k * (history - sigma**alpha * position))[which]

    return [float(mpmath.invertlaplace(lambda s, i=i: transform(s, i), time, method="talbot")) for i in (0, 1)]


@pytest.mark.parametrize(("solver", "smooth", "other"), SOLVERS)
def test_a_batch_with_orders_in_all_ranges(solver: Solver, smooth: float, other: float) -> None:
    """Initial values enter D^α differently for α ≤ 0, 0 < α ≤ 1 and 1 < α: members of all kinds may come together."""
    del smooth
    alpha, times, start = [0.8, 1.3, -0.4, 1.0, 0.0, 0.5, 1.2, -1.0], [0.4, 3.0, 9.0], (0.3, 1.0)
    trajectory = solver.solve(ClosedLoop(HCWOutOfPlane(), Damper(0.7, alpha)), np.array(start), HORIZON)
    for i, order in enumerate(alpha):
        exact = np.array([from_laplace(0.7, order, start, time) for time in times])
        found = np.stack([trajectory(times)[i, :, 0], trajectory.control(times)[i, :, 0]], axis=1)
        assert np.abs(found - exact).max() < other, order
