"""Implicit steps with memory against Mittag-Leffler functions, explicit integration, and motions of closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fracctl.compiling import ACCELERATION, DEMAND, pointer_with
from fracctl.controllers import DelayedFeedback, Saturation
from fracctl.controllers.references import Approach
from fracctl.controllers.sliding_mode import AdaptiveSlidingMode
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.loop import ClosedLoop
from fracctl.measures import length_overshoot, length_settling
from fracctl.meshwise import MeshTrajectory
from fracctl.plants import FunctionPlant, Libration, Tether
from fracctl.plants.state import Event, SecondOrder
from fracctl.solvers.implicit_memory.solver import ImplicitMemory, graded_mesh, halved
from tests.references.series import mittag_leffler

TURN = 2.0 * math.pi
START = [0.0009, 0.1, 0.1, 0.7, 0.0, 0.0]


@pointer_with(ACCELERATION)
def _pushed(t: float, q: Any, v: Any, u: Any, parameters: Any, out: Any) -> None:
    for i in range(len(q)):
        out[i] = u[i] - parameters[0] * q[i] + 0.0 * math.sqrt(parameters[1] - t)


class Cart(SecondOrder):
    """q'' = u - s q, of m carts; no number after `broken`."""

    scales = None
    acceleration = staticmethod(_pushed)

    def __init__(self, m: int = 1, spring: float = 0.0, broken: float = 1e9, wall: float = -1e9) -> None:
        self.components = tuple("abc"[:m])
        self._given, self.wall = (spring, broken), wall

    @property
    def events(self) -> tuple[Event, ...]:
        return (
            Event("wall", lambda t, x: x[:, 0] - self.wall),
            Event("slow", lambda t, x: x[:, len(self.components)] + 0.5, terminal=False),
        )

    def kernel_parameters(self, batch: int) -> np.ndarray:
        return np.tile(self._given, (batch, 1))

    def rates(self, t: np.ndarray, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    jacobians = rates


@pointer_with(DEMAND)
def _linear(
    t: float, q: Any, v: Any, e: Any, de: Any, d: Any, c: float, base: Any, peaks: Any, law: Any, z: Any, w: Any
) -> None:
    for i in range(len(w)):
        w[i] = law[3] - law[0] * e[i] - law[1] * de[i] - law[2] * d[i]


@pointer_with(DEMAND)
def _relay(
    t: float, q: Any, v: Any, e: Any, de: Any, d: Any, c: float, base: Any, peaks: Any, law: Any, z: Any, w: Any
) -> None:
    for i in range(len(w)):
        w[i] = -min(max((v[i] + q[i]) / 1e-6, -1.0), 1.0)


@pointer_with(DEMAND)
def _chasing(
    t: float, q: Any, v: Any, e: Any, de: Any, d: Any, c: float, base: Any, peaks: Any, law: Any, z: Any, w: Any
) -> None:
    w[0] = min(max(v[1] / 1e-12, -1.0), 1.0)
    w[1] = -min(max(v[0] / 1e-12, -1.0), 1.0)


class Law:
    """w = w₀ - k Δq - l Δq' - k_D D^ν Δq, or another compiled demand."""

    def __init__(
        self,
        k: float = 0.0,
        rate: float = 0.0,
        k_d: Any = 0.0,
        constant: float = 0.0,
        nu: Any = 0.5,
        caputo: bool = True,
        demand: Any = _linear,
        reference: Any = None,
        m: int = 1,
    ) -> None:
        self.given, self.nu, self.caputo, self.demand = (k, rate, k_d, constant), np.asarray(nu), caputo, demand
        self._reference = reference or Approach(0.0, 0.0, 0.0, m)
        self.batch = max((len(np.atleast_1d(v)) for v in (k_d, nu)), default=1)
        self.batch = None if np.ndim(k_d) == 0 and np.ndim(nu) == 0 else self.batch

    def numbers(self, plant: Any, batch: int) -> np.ndarray:
        return np.stack([np.broadcast_to(value, (batch,)) for value in self.given], axis=1).astype(float)

    def orders(self, n_controls: int, batch: int) -> np.ndarray:
        return np.array(np.broadcast_to(self.nu.reshape(-1, 1), (batch, n_controls)), dtype=float)

    def initial_memory(self, error: np.ndarray) -> np.ndarray:
        return 0.0 * error if self.caputo else error

    def initial_auxiliary(self, batch: int) -> np.ndarray:
        return np.zeros((batch, 0))

    def reference(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self._reference(times)


def solve(plant: Any, law: Any, start: Any, horizon: float, saturation: Any = None, **given: Any) -> MeshTrajectory:
    return ImplicitMemory(**given).solve(ClosedLoop(plant, law, saturation), start, horizon)


def braked(nu: float, k_d: float, value: float, rate: float, time: float, caputo: bool) -> float:
    """q'' = -k_D D^ν q: q₀ (1 of Caputo, E_{2-ν,1} of Riemann and Liouville) + q₀' t E_{2-ν,2}, of -k_D t^(2-ν)."""
    z = -k_d * time ** (2.0 - nu)
    first = 1.0 if caputo else mittag_leffler(2.0 - nu, 1.0, z)
    return float(value * first + rate * time * mittag_leffler(2.0 - nu, 2.0, z))


TIMES = np.array([1e-6, 1e-3, 0.1, 0.7, 2.0, 5.0])


@pytest.mark.parametrize("caputo", [True, False])
def test_fractional_brakes_are_mittag_leffler_functions(caputo: bool) -> None:
    """Members of three orders and gains at once; the error estimate bounds the error."""
    orders, gains, value, rate = [0.3, 0.5, 0.8], [1.3, 0.8, 2.0], 0.9, -0.7
    law = Law(k_d=gains, nu=orders, caputo=caputo)
    trajectory = solve(Cart(), law, [value, rate], 5.0, first_step=1e-9 if caputo else 1e-28)
    assert trajectory.status.tolist() == ["ok"] * 3
    found = trajectory(TIMES)[..., 0]
    for i in range(3):
        exact = [braked(orders[i], gains[i], value, rate, t, caputo) for t in TIMES]
        np.testing.assert_allclose(found[i], exact, rtol=0, atol=4e-6 if caputo else 3e-4)
        on_mesh = trajectory.times[::97]
        error = trajectory.on_mesh[i, ::97, 0] - [braked(orders[i], gains[i], value, rate, t, caputo) for t in on_mesh]
        peak = np.abs(trajectory.on_mesh[i, :, 0]).max()
        assert np.abs(error).max() / peak < trajectory.error_estimate[i] < 1e-3
    assert (trajectory.memory_error <= 1e-8).all()
    assert (trajectory.memory_error > 0.0).all()


def test_the_memory_is_the_derivative() -> None:
    """D^ν of a fall with constant acceleration: Caputo -t^(2-ν)/Γ(3-ν), and q₀ t^(-ν)/Γ(1-ν) more of the other."""
    times = np.array([1e-3, 0.03, 0.9, 2.9])
    for caputo in (True, False):
        law = Law(constant=-1.0, nu=[0.2, 0.5, 0.9], caputo=caputo)
        trajectory = solve(Cart(), law, [4.0, 0.0], 3.0)
        np.testing.assert_allclose(trajectory(times)[..., 0], [4.0 - times**2 / 2.0] * 3, rtol=1e-9)
        for i, nu in enumerate((0.2, 0.5, 0.9)):
            k = np.searchsorted(trajectory.times, times)
            t = trajectory.times[k]
            exact = -(t ** (2.0 - nu)) / math.gamma(3.0 - nu)
            if not caputo:
                exact += 4.0 * t**-nu / math.gamma(1.0 - nu)
            np.testing.assert_allclose(trajectory.memory[i, k, 0], exact, rtol=2e-6)


def test_a_looser_kernel_shows_and_keeps_its_bound() -> None:
    tight = solve(Cart(), Law(k_d=1.0), [1.0, -1.0], 2.0)
    loose = solve(Cart(), Law(k_d=1.0), [1.0, -1.0], 2.0, memory_tolerance=1e-3)
    assert 1e-6 < loose.memory_error[0] <= 1e-3
    change = np.abs(loose.on_mesh - tight.on_mesh).max()
    assert 1e-9 < change < loose.memory_error[0]


def test_the_order_is_two() -> None:
    """In the number of steps, for the mesh is not quite halved with its largest step."""
    errors, counts = [], []
    for step in (8e-3, 4e-3, 2e-3):
        trajectory = solve(Cart(spring=1.0), Law(rate=0.1), [1.0, 0.0], 8.0, step=step)
        t, damped = trajectory.times, math.sqrt(1.0 - 0.05**2)
        exact = np.exp(-0.05 * t) * (np.cos(damped * t) + 0.05 / damped * np.sin(damped * t))
        errors.append(np.abs(trajectory.states[:, 0] - exact).max())
        counts.append(len(t))
        assert errors[-1] < trajectory.error_estimate[0] < 4.0 * errors[-1]
    np.testing.assert_allclose(-np.diff(np.log(errors)) / np.diff(np.log(counts)), 2.0, atol=0.2)


def tether_explicitly(plant: Tether, law: Law, start: list[float], times: np.ndarray) -> np.ndarray:
    """The tether under a law without memory by an explicit method of order 8."""
    k, rate, _, constant = law.given

    def right(t: float, x: np.ndarray) -> np.ndarray:
        wanted, slope = law.reference(np.array([t]))
        u = constant - k * (x[:3] - wanted[0]) - rate * (x[3:] - slope[0])
        return plant.rates(np.array([t]), x[None], u[None])[0]

    found = solve_ivp(right, (0.0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-12)
    return found.y.T


def test_a_swinging_tether_agrees_with_explicit_integration() -> None:
    """Wide limits and a smooth law from near rest, on an eccentric orbit, following a reference that moves."""
    plant = Tether(0.1, disturbance_phase=0.4)
    law = Law(6.0, 2.0, constant=-0.45, reference=Approach(0.8, 1.0, 0.6), m=3)
    start, times = [1.0, 0.05, -0.08, 0.02, 0.03, -0.04], np.linspace(0.5, 6.0, 12)
    trajectory = solve(plant, law, start, 6.0)
    exact = tether_explicitly(plant, law, start, times)
    np.testing.assert_allclose(trajectory(times)[:, :3], exact[:, :3], atol=5e-6)
    np.testing.assert_allclose(trajectory(times)[:, 3:], exact[:, 3:], atol=1e-5)
    k = np.searchsorted(trajectory.times, times) - 1
    on_mesh = tether_explicitly(plant, law, start, trajectory.times[k])
    error = np.abs(trajectory.on_mesh[0, k, :3] - on_mesh[:, :3]) / np.abs(trajectory.on_mesh[0, :, :3]).max(axis=0)
    assert error.max() < trajectory.error_estimate[0] < 1e-4
    coarser = solve(plant, law, start, 6.0, step=8e-3)
    assert coarser.error_estimate[0] == pytest.approx(4.0 * trajectory.error_estimate[0], rel=0.3)


def test_a_relay_is_followed_where_newtons_method_is_not() -> None:
    """q'' = -sgn(q + q') from rest at 1: a fall to √3 - 1, from where q e^t stays."""
    trajectory = solve(Cart(), Law(demand=_relay), [1.0, 0.0], 3.0)
    assert trajectory.counters["bracketed"][0] > 0
    assert trajectory.counters["unresolved"].tolist() == [0]
    assert trajectory.status.tolist() == ["ok"]
    reached = math.sqrt(3.0) - 1.0
    t = np.array([0.3, 0.7, 0.8, 1.5, 3.0])
    fall, slide = 1.0 - t**2 / 2.0, (1.0 - reached**2 / 2.0) * np.exp(reached - t)
    np.testing.assert_allclose(trajectory(t)[:, 0], np.where(t < reached, fall, slide), atol=3e-6)


def test_equations_that_are_not_solved_fail_the_member() -> None:
    """Two carts that run after and away from each other jump at every step."""
    trajectory = solve(Cart(2), Law(demand=_chasing, m=2), [0.0, 0.0, 1e-4, 0.0], 0.5, first_step=1e-3)
    assert trajectory.counters["unresolved"][0] > 0
    assert trajectory.status.tolist() == ["failed"]


def test_a_tolerance_fails_what_is_less_accurate() -> None:
    law = Law(k_d=[1.0, 100.0])
    found = solve(Cart(), law, [1.0, -1.0], 2.0, step=0.05)
    between = math.sqrt(found.error_estimate[0] * found.error_estimate[1])
    again = solve(Cart(), law, [1.0, -1.0], 2.0, step=0.05, tolerance=between)
    order = np.argsort(found.error_estimate)
    assert again.status[order].tolist() == ["ok", "failed"]


def test_terminal_events_end_a_member_where_they_happen() -> None:
    """1 - t²/2 meets 1/2 at t = 1, after its speed has passed -1/2 at t = 1/2; another goes on."""
    law = Law(constant=-1.0, nu=[0.5, 0.5])
    trajectory = solve(Cart(wall=0.5), law, [[1.0, 0.0], [10.0, 0.0]], 2.0)
    assert trajectory.status.tolist() == ["wall", "ok"]
    assert trajectory.end[0] == pytest.approx(1.0, abs=1e-9)
    assert trajectory.events["wall"][0] == trajectory.end[0]
    assert np.isnan(trajectory.events["wall"][1])
    np.testing.assert_allclose(trajectory.events["slow"], 0.5, atol=1e-9)
    assert np.isnan(trajectory([1.1])[0]).all()
    assert np.isfinite(trajectory([0.99, 1.1])[1]).all()
    assert trajectory.counters["steps"][0] < trajectory.counters["steps"][1] == len(trajectory.times) - 1
    early = solve(Cart(wall=0.9), law, [1.0, 0.0], 2.0)
    assert np.isnan(early.events["slow"]).all()


def test_motions_that_overflow_diverge() -> None:
    """q'' = 10⁶ q grows as e^(1000 t), past the largest number at t = 0.71."""
    trajectory = solve(Cart(spring=-1e6), Law(), [1.0, 1000.0], 1.0, step=1e-4)
    assert trajectory.status.tolist() == ["diverged"]
    assert trajectory.end[0] == pytest.approx(math.log(np.finfo(float).max) / 1000.0, rel=0.03)
    assert np.isnan(trajectory([0.8])).all()
    assert np.isfinite(trajectory([0.6])).all()


def test_accelerations_that_are_no_number_end_a_member() -> None:
    trajectory = solve(Cart(broken=1.0), Law(constant=-1.0), [1.0, 0.0], 2.0)
    assert trajectory.status.tolist() == ["diverged"]
    assert 1.0 - 2e-3 < trajectory.end[0] <= 1.0


def test_members_of_a_batch_are_solved_as_alone() -> None:
    """But for the mesh, which suits all: orders, gains, starts, references and limits differ from member to member."""
    starts = np.array([[0.0009, 0.1, 0.1, 0.7, 0.0, 0.0], [0.5, -0.05, 0.02, 0.1, 0.0, 0.1], [1.0] + [0.0] * 5])
    limits = np.array([[2.45, 5.0, 5.0], [2.45, 1.0, 0.5], [2.0, 3.0, 4.0]])
    tables = {"nu": [0.5, 0.5, 0.5], "alpha_1": [0.5, 0.0, 0.8], "caputo": [0.0, 1.0, 0.0]}
    approach = {"target": [1.0, 0.7, 0.5], "start": [1.0, 0.5, 1.0], "rate": [0.0, 0.7, 1.1]}
    together = solve(
        Tether(), AdaptiveSlidingMode(**tables, reference=Approach(**approach)), starts, 1.0, Saturation(limits, "axis")
    )
    assert together.states.shape == (3, len(together.times), 6)
    for i in range(3):
        law = AdaptiveSlidingMode(
            **{name: values[i] for name, values in tables.items()},
            reference=Approach(**{name: values[i] for name, values in approach.items()}),
        )
        alone = solve(Tether(), law, starts[i], 1.0, Saturation(limits[i][None], "axis"))
        times = np.linspace(0.0, 1.0, 21)
        np.testing.assert_allclose(alone(times)[:, :3], together(times)[i, :, :3], atol=3e-5)
        np.testing.assert_allclose(alone(times)[1:, 3:], together(times)[i, 1:, 3:], atol=1e-3)


def test_members_on_the_same_mesh_do_not_know_of_each_other() -> None:
    """Bit for bit, in any order."""
    starts = np.array([[0.9, -0.7], [0.2, 0.4], [-1.0, 0.1]])
    one = solve(Cart(), Law(k_d=[1.0, 2.0, 3.0], nu=[0.3, 0.5, 0.8]), starts, 1.0)
    other = solve(Cart(), Law(k_d=[3.0, 1.0, 2.0], nu=[0.8, 0.3, 0.5]), starts[[2, 0, 1]], 1.0)
    for name in ("states", "controls", "memory"):
        np.testing.assert_array_equal(getattr(one, name)[[2, 0, 1]], getattr(other, name))


@pytest.mark.parametrize(
    ("saturation", "bounds"),
    [
        (None, [[np.inf] * 2] * 2),
        (Saturation(0.7, "axis"), [[0.7, 0.7]] * 2),
        (Saturation([[0.7], [0.4]], "axis"), [[0.7, 0.7], [0.4, 0.4]]),
        (Saturation([0.7, 0.5], "axis"), [[0.7, 0.5]] * 2),
        (Saturation([[0.7, 0.5]], "axis"), [[0.7, 0.5]] * 2),
        (Saturation([[0.7, 0.5], [0.3, 0.4]], "axis"), [[0.7, 0.5], [0.3, 0.4]]),
    ],
)
def test_limits_hold_for_each_control(saturation: Saturation | None, bounds: list[list[float]]) -> None:
    """A constant demand of 0.6 accelerates by itself or by its limit."""
    trajectory = solve(Cart(2), Law(constant=0.6, nu=[0.5, 0.5], m=2), [0.0] * 4, 1.0, saturation)
    np.testing.assert_array_equal(trajectory.limits[:, 1], bounds)
    np.testing.assert_array_equal(trajectory.limits[:, 0], -np.array(bounds))
    np.testing.assert_allclose(trajectory([1.0])[:, 0, :2], np.minimum(bounds, 0.6) / 2.0, rtol=1e-9)
    np.testing.assert_allclose(trajectory.control([0.4])[:, 0], np.minimum(bounds, 0.6))
    np.testing.assert_allclose(trajectory.demand([0.4])[:, 0], 0.6)


@pytest.mark.parametrize(
    ("first", "step", "horizon"), [(1e-9, 2e-3, 12.6), (1e-3, 0.5, 7.0), (1e-9, 2e-3, 1e-3), (1e-3, 1e-2, 1e-2)]
)
def test_meshes_grow_smoothly_and_end_at_the_horizon(first: float, step: float, horizon: float) -> None:
    mesh = graded_mesh(first, step, horizon)
    steps = np.diff(mesh)
    assert (mesh[0], mesh[-1]) == (0.0, horizon)
    assert first / 1.21 < steps[0] <= first * (1.0 + 1e-9)
    assert steps[:-1].max() <= step * (1.0 + 1e-9)
    assert 0.49 < steps[-1] / steps[-2] < 1.81
    assert (steps[1:-1] / steps[:-2]).max() < 1.21
    assert (steps[1:-1] / steps[:-2]).min() > 0.99
    fine = halved(mesh)
    np.testing.assert_array_equal(fine[::2], mesh)
    np.testing.assert_allclose(np.diff(fine)[::2], np.diff(fine)[1::2], rtol=1e-5)


@pytest.mark.parametrize(
    ("loop", "sentence"),
    [
        (ClosedLoop(Libration()), "does not take free motion; use 'method_of_steps'"),
        (ClosedLoop(Libration(), DelayedFeedback(np.zeros((1, 2)), 1.0)), "does not take DelayedFeedback; use"),
        (ClosedLoop(FunctionPlant(lambda t, x, u: x, 2, 1), Law()), "needs a plant with a compiled acceleration"),
        (ClosedLoop(Cart(), Law(), Saturation(1.0, "norm")), "limits each control by itself; use a saturation by axis"),
    ],
)
def test_other_loops_are_refused(loop: ClosedLoop, sentence: str) -> None:
    assert sentence in str(ImplicitMemory().supports(loop))
    with pytest.raises(UnsupportedError, match=sentence):
        ImplicitMemory().solve(loop, [1.0, 0.0], 1.0)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ImplicitMemory(step=0.0), "`step` must be positive"),
        (lambda: ImplicitMemory(step=1e-3, first_step=1e-2), "`first_step` must not be above `step`, 0.001"),
        (lambda: ImplicitMemory(memory_tolerance=0.5), "`memory_tolerance` must lie in"),
        (lambda: ImplicitMemory(tolerance=1.0), "`tolerance` must lie in"),
        (lambda: solve(Cart(), Law(), [1.0, 0.0, 0.0], 1.0), r"`initial_state` must have shape \(2,\) or \(b, 2\)"),
        (lambda: solve(Cart(), Law(), [1.0, 0.0], 0.0), "`horizon` must be positive"),
        (lambda: solve(Cart(), Law(), [1.0, 0.0], 1.0)([1.1]), r"`times` must lie in \[0, 1\]"),
    ],
)
def test_wrong_numbers_are_refused(make: Callable[[], object], sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make()


def deployed(law: Any, e: float = 0.0027, start: Any = START, turns: float = 2.0, **given: Any) -> MeshTrajectory:
    plant = Tether(e)
    return solve(plant, law, start, turns * TURN, Saturation(plant.limits, "axis"), **given)


@pytest.mark.slow
def test_the_derivative_of_caputo_never_settles() -> None:
    found = deployed(AdaptiveSlidingMode(caputo=1.0))
    assert length_settling(found) == np.inf
    assert found.status.tolist() == ["ok"]


@pytest.mark.slow
@pytest.mark.parametrize(("e", "phi_2", "rate"), [(0.0027, 0.0054, 0.7), (0.17, 0.41, 0.6)])
@pytest.mark.parametrize("alpha_1", [0.5, 0.0])
def test_half_the_step_changes_nothing_visible(e: float, phi_2: float, rate: float, alpha_1: float) -> None:
    law, start = AdaptiveSlidingMode(alpha_1=alpha_1, phi_2=phi_2), [*START[:3], rate, 0.0, 0.0]
    coarse, fine = (deployed(law, e, start, step=step) for step in (2e-3, 1e-3))
    for found in (coarse, fine):
        assert found.counters["unresolved"].tolist() == [0]
        assert found.error_estimate[0] < 1e-4
    assert length_settling(coarse) == pytest.approx(length_settling(fine), abs=1e-5)
    assert length_overshoot(coarse) == pytest.approx(length_overshoot(fine), abs=1e-3)


@pytest.mark.slow
def test_tethers_are_drawn_in_along_an_approach_and_not_by_a_step() -> None:
    """To a tenth with c = 0.5, 0.7 and 1: within 2 % of the way after 1.2435, 0.8794 and 0.5654 orbits."""
    law = AdaptiveSlidingMode(reference=Approach(0.1, 1.0, [0.5, 0.7, 1.0, 0.0]))
    found = deployed(law, start=[1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert found.status.tolist() == ["ok", "ok", "ok", "collision"]
    settled = np.asarray(length_settling(found))
    np.testing.assert_allclose(settled[:3], [1.2435, 0.8794, 0.5654], atol=1e-4)
    assert settled[3] == np.inf


@pytest.mark.slow
def test_a_deployed_tether_is_kept_in_place() -> None:
    """To 0.03 % of its length and 4e-5 rad."""
    found = deployed(AdaptiveSlidingMode(), start=[1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    away = np.abs(found.on_mesh[0, :, :3] - [1.0, 0.0, 0.0]).max(axis=0)
    assert (away < [3e-4, 4e-5, 4e-5]).all()
    assert length_overshoot(found) == pytest.approx(100.0 * away[0], rel=1e-3)
