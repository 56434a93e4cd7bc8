"""Explicit collocation with memory: linear references, saturation, nonlinear plants, and how it says what fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import rgamma

from fracctl.controllers import PD, DelayedFeedback, LinearLawTerms, PDAlpha, PDLag, PILambdaDMu, Saturation
from fracctl.design import LQR
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.terms import FractionalTerm
from fracctl.loop import ClosedLoop
from fracctl.plants import HCW, Event, FunctionPlant, HCWInPlane, HCWOutOfPlane, Libration, RelativeMotion
from fracctl.plants.state import SecondOrder
from fracctl.solvers import Contour, ExplicitMemory, MethodOfSteps, solve
from fracctl.solvers.explicit_memory.law import signals
from fracctl.solvers.explicit_memory.mesh import step_edges
from fracctl.solvers.explicit_memory.run import Problem, run
from fracctl.trajectory import Trajectory
from tests.references import loops, poles
from tests.references.laplace import QuickReference, Reference
from tests.references.loops import Loop
from tests.references.product import check_times, closed_loop
from tests.solvers.test_closed_forms import Damper

HORIZON = 4.0 * np.pi
TIMES = check_times(HORIZON)
K_P = np.array([[4.1, -1.55, 0.0], [3.15, 0.9, 0.0], [0.0, 0.0, 0.85]])
K_D = np.array([[2.7, 1.05, 0.0], [0.9, 2.05, 0.0], [0.0, 0.0, 2.0]])
ORDERS = np.array([0.98, 0.9, 0.91])
START = np.array([-1e-3, 0.0, 0.0, 0.0, 2e-3, 2e-3])
"""The paper's IC1."""
IN_PLANE = [m for m in loops.random_in_plane(41, 30, spread=2.0) if poles.unstable_count(m) == 0][:4]
OUT_OF_PLANE = [
    *(loops.out_of_plane(0.85, 2.0, alpha, [1e-3, 2e-3]) for alpha in (0.1, 0.5, 0.91, 0.99)),
    loops.out_of_plane(100.0, 20.0, 0.9, [1e-3, -2e-3]),
]


def errors(trajectory: Trajectory, i: int, member: Loop) -> float:
    """Return the largest error of positions and controls over their peaks."""
    exact = Reference(member, 16)(TIMES)
    position, control = trajectory(TIMES)[i, :, : member.size], trajectory.control(TIMES)[i]
    return float(
        max(
            np.abs(position - exact.position).max() / np.abs(exact.position).max(),
            np.abs(control - exact.control).max() / np.abs(exact.control).max(),
        )
    )


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-10])
@pytest.mark.parametrize("members", [IN_PLANE, OUT_OF_PLANE], ids=["in plane", "out of plane"])
def test_the_estimate_bounds_the_error(members: list[Loop], tolerance: float) -> None:
    starts = np.array([member.start for member in members])
    trajectory = ExplicitMemory(tolerance=tolerance).solve(closed_loop(members), starts, HORIZON)
    assert set(trajectory.status) == {"ok"}
    assert set(trajectory.stable) == {True}
    for i, member in enumerate(members):
        assert errors(trajectory, i, member) <= trajectory.error_estimate[i] <= tolerance


@pytest.mark.parametrize("alpha", [1.2, 1.5, 1.8])
def test_orders_above_one(alpha: float) -> None:
    """From w' alone; no reference but an independent solver."""
    loop = ClosedLoop(HCWOutOfPlane(), Damper(0.8, alpha))
    exact, found = (solver.solve(loop, [0.0, 1e-3], 10.0) for solver in (Contour(1e-10), ExplicitMemory()))
    times = TIMES[TIMES <= 10.0]
    assert np.abs(found(times) - exact(times))[:, 0].max() < 1e-9 * np.abs(exact.states[:, 0]).max()
    assert np.abs(found.control(times) - exact.control(times)).max() < 1e-9 * np.abs(exact.controls).max()


def test_members_with_orders_of_every_kind_in_one_batch() -> None:
    """Below, at and above one, zero and integrals: each as if it were alone, which other tests compare."""
    orders = np.array([-1.0, -0.4, 0.0, 0.3, 1.0, 1.5])
    term = FractionalTerm(np.array([[-0.8]]), orders[:, None])

    @dataclass(frozen=True)
    class Law:
        terms: tuple[FractionalTerm, ...]

        def linear_terms(self, n_controls: int) -> LinearLawTerms:
            del n_controls
            return LinearLawTerms(self.terms)

    solver = ExplicitMemory()
    batch = solver.solve(ClosedLoop(HCWOutOfPlane(), Law((term,))), [1e-3, 2e-3], 5.0)
    for i, order in enumerate(orders):
        exact = Contour().solve(ClosedLoop(HCWOutOfPlane(), Law((term.take(np.array([i])),))), [1e-3, 2e-3], 5.0)
        times = np.linspace(0.0, 5.0, 40)
        assert np.abs(batch.control(times)[i] - exact.control(times)).max() < 1e-8 * 4e-3, order
        assert batch.stable[i] == exact.stable.item()


@pytest.mark.parametrize(
    "law", [PDAlpha(K_P, K_D, ORDERS), PDLag(K_P, K_D, 0.3), PILambdaDMu(K_P, 0.1 * K_D, K_D, 0.7, 0.8)]
)
def test_a_batch_is_its_members(law: PDAlpha) -> None:
    generator = np.random.default_rng(3)
    starts = generator.uniform(-2e-3, 2e-3, (7, 6))
    batch = ExplicitMemory().solve(ClosedLoop(RelativeMotion(), law), starts, 5.0)
    times = np.linspace(0.0, 5.0, 30)
    assert batch.batched
    for i, start in enumerate(starts):
        single = ExplicitMemory().solve(ClosedLoop(RelativeMotion(), law), start, 5.0)
        assert not single.batched
        np.testing.assert_allclose(batch(times)[i], single(times), atol=1e-11 * 2e-3)
        np.testing.assert_allclose(batch.control(times)[i], single.control(times), atol=1e-10 * 2e-3)


def test_a_survey_holds_every_member_from_every_state() -> None:
    orders = np.linspace(0.5, 1.0, 300)
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, orders))
    states = np.array([[0.0, 2e-3], [1e-3, 0.0]])
    seen = np.zeros(300)
    for part in ExplicitMemory(tolerance=1e-6).survey(loop, states, 3.0):
        seen[part.rows] += 1
        r = len(part.rows)
        assert set(part.trajectory.status) == {"ok"}
        for place in (0, r - 1):
            for k in range(2):
                member = loops.out_of_plane(0.85, 2.0, orders[part.rows[place]], states[k])
                exact = QuickReference(member)(np.array([2.9])).position.item()
                assert part.trajectory([2.9])[k * r + place, 0, 0] == pytest.approx(exact, abs=1e-9)
    assert set(seen) == {1.0}


def damped_by(alpha: float, nodes: int, count: int) -> float:
    """Return the error at the end of w'' = -(1 + k_P) w - k_D D^α w on even steps from the graded first one."""
    member = loops.out_of_plane(0.85, 2.0, alpha, [1e-3, 2e-3])
    loop = closed_loop([member])
    problem = Problem(loop.plant, signals(loop.law_terms, 1), None, member.start[None], 4.0)
    found = run(problem, step_edges(4.0, count, 1e-9, np.zeros(0), problem.has_powers), nodes, 1e-12)
    return float(np.abs(found.values[0, 0, -1, -1] - QuickReference(member)(np.array([4.0])).position.item()))


@pytest.mark.parametrize(("nodes", "order"), [(3, 4.0), (5, 6.0), (4, 4.0), (6, 6.0)])
def test_orders_of_convergence_without_memory(nodes: int, order: float) -> None:
    """K Chebyshev-Lobatto nodes integrate polynomials of degree K - 1, by symmetry K for odd K."""
    counts = np.array([8, 12, 16, 24])
    found = [damped_by(1.0, nodes, count) for count in counts]
    assert -np.polyfit(np.log(counts), np.log(found), 1)[0] == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("alpha", [0.1, 0.2, 0.35, 0.5, 0.65])
def test_orders_of_convergence_with_memory(alpha: float) -> None:
    """The polynomial of ξ' is off by O(h^K), and what I^(1-α) on the step makes of it by O(h^(K+1-α))."""
    counts = np.array([8, 12, 16, 24])
    found = [damped_by(alpha, 3, count) for count in counts]
    assert -np.polyfit(np.log(counts), np.log(found), 1)[0] == pytest.approx(4.0 - alpha, abs=0.25)


def limited(law: PDAlpha, top: float, by: str, start: np.ndarray, horizon: float, tolerance: float) -> Trajectory:
    loop = ClosedLoop(RelativeMotion(), law, Saturation(top, by))  # type: ignore[arg-type]
    return ExplicitMemory(tolerance=tolerance).solve(loop, start, horizon)


CLIPS: dict[str, Callable[[np.ndarray, float], np.ndarray]] = {
    "norm": lambda w, top: w * min(1.0, top / max(np.linalg.norm(w), 1e-300)),
    "axis": lambda w, top: np.clip(w, -top, top),
}


@pytest.mark.parametrize(("by", "top"), [("norm", 1.0), ("norm", 5e-4), ("axis", 1.0), ("axis", 2e-4)])
def test_nonlinear_and_saturated_motion_under_pd_is_that_of_an_integrator(by: str, top: float) -> None:
    """DOP853 at 1e-13, with a limit that is never reached and one that is."""
    plant, law = RelativeMotion(eccentricity=0.1), PDAlpha(K_P, K_D, 1.0)

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        u = CLIPS[by](-K_P @ x[:3] - K_D @ x[3:], top)
        return plant.rates(np.array([t]), x[None], u[None])[0]

    start = np.array([-1e-2, 5e-3, 2e-3, 0.0, 2e-2, 1e-2])
    times = np.linspace(0.0, HORIZON, 60)
    exact = solve_ivp(rates, (0.0, HORIZON), start, "DOP853", times, rtol=1e-13, atol=1e-16, max_step=0.01).y.T
    loop = ClosedLoop(plant, law, Saturation(top, by))  # type: ignore[arg-type]
    found = ExplicitMemory(tolerance=1e-9).solve(loop, start, HORIZON)
    gap = np.abs(found(times) - exact)[:, :3].max() / np.abs(exact[:, :3]).max()
    assert gap < 1e-9
    assert gap < found.error_estimate.item() <= 1e-9
    assert found.status.item() == "ok"


@pytest.mark.parametrize("by", ["norm", "axis"])
def test_a_limit_that_is_never_reached_changes_nothing(by: str) -> None:
    loop = ClosedLoop(RelativeMotion(), PDAlpha(K_P, K_D, ORDERS))
    free = ExplicitMemory().solve(loop, START, HORIZON)
    np.testing.assert_array_equal(
        limited(PDAlpha(K_P, K_D, ORDERS), 1.0, by, START, HORIZON, 1e-8).positions, free.positions
    )


def demand_by_quadrature(trajectory: Trajectory, time: float) -> np.ndarray:
    """-K_P ξ - K_D D^α ξ, Caputo's integral by Gauss's rule on pieces that shrink towards its singularity."""
    ends = np.array([panel.end for panel in trajectory.grid.panels])
    edges = np.unique([*(time - ends[ends < time]), *(time * 2.0 ** -np.arange(41.0))])
    x, w = np.polynomial.legendre.leggauss(24)
    half = 0.5 * np.diff(edges)
    ages = (edges[:-1, None] + half[:, None] * (x + 1.0)).ravel()
    mu, rates = 1.0 - ORDERS, trajectory(time - ages)[:, 3:]
    memory = ((half[:, None] * w).ravel()[:, None] * rates * ages[:, None] ** (mu - 1.0)).sum(axis=0)
    memory += trajectory([time])[0, 3:] * edges[0] ** mu / mu
    return -K_P @ trajectory([time])[0, :3] - K_D @ (memory * rgamma(mu))


@pytest.mark.parametrize(("by", "top"), [("norm", 1e-3), ("axis", 3e-4)])
def test_saturated_fractional_control_satisfies_its_equations(by: str, top: float) -> None:
    """The control is what the limit makes of the demand, computed anew; the motion is the plant's under it."""
    plant = RelativeMotion()
    found = limited(PDAlpha(K_P, K_D, ORDERS), top, by, START, 8.0, 1e-9)
    assert found.status.item() == "ok"
    held = 0
    for time in (0.03, 0.4, 1.1, 2.3, 3.7, 4.9, 6.6, 7.9):
        demand = demand_by_quadrature(found, time)
        expected = CLIPS[by](demand, top)
        held += int(np.sum(~np.isclose(demand, expected, rtol=1e-9)))
        np.testing.assert_allclose(found.control([time])[0], expected, atol=1e-8 * top)
    assert 0 < held < 24, "both with and without saturation"
    times = np.linspace(0.01, 8.0, 50)
    exact = solve_ivp(
        lambda t, x: plant.rates(np.array([t]), x[None], found.control([min(t, 8.0)]))[0],
        (0.0, 8.0),
        START,
        "DOP853",
        times,
        rtol=1e-10,
        atol=1e-14,
        max_step=0.05,
    ).y.T
    np.testing.assert_allclose(found(times)[:, :3], exact[:, :3], atol=1e-8 * 1e-3)


def test_full_thrust_is_a_closed_form_until_it_ends() -> None:
    """w'' = -w - L from rest at w₀, where k_P w₀ > L: w = (w₀ + L) cos t - L, and D^α w is a series."""
    start, top, k_d, alpha = 2e-3, 1e-3, 2.0, 0.5
    loop = ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, k_d, alpha), Saturation(top))
    found = ExplicitMemory().solve(loop, [start, 0.0], 3.0)
    k = np.arange(1, 30)

    def demand(t: float) -> float:
        memory = np.sum((-1.0) ** k * t ** (2 * k - alpha) * rgamma(2 * k + 1 - alpha))
        return float(-0.85 * ((start + top) * np.cos(t) - top) - k_d * (start + top) * memory)

    end = brentq(lambda t: demand(t) + top, 0.01, 1.0, xtol=1e-15)
    moving = np.linspace(0.0, end, 20)
    np.testing.assert_allclose(found(moving)[:, 0], (start + top) * np.cos(moving) - top, atol=1e-9 * start)
    np.testing.assert_allclose(found.control(moving)[:, 0], -top, rtol=1e-9)
    ends = np.array([panel.end for panel in found.grid.panels])
    assert np.abs(ends - end).min() < 1e-9
    assert abs(found.control([end + 0.01]).item()) < top


@pytest.mark.parametrize("alpha", [1.0, 0.91, 0.6])
def test_nonlinear_motion_departs_from_linear_motion_with_the_square_of_the_distance(alpha: float) -> None:
    law, distances = PDAlpha(K_P, K_D, alpha), np.array([1e-3, 2e-3, 4e-3, 8e-3])
    times = np.linspace(0.1, HORIZON, 40)
    linear = Contour(1e-10).solve(ClosedLoop(HCW(), law), START / 1e-3, HORIZON)(times)
    solver = ExplicitMemory(tolerance=1e-9)
    gaps = [
        np.abs(solver.solve(ClosedLoop(RelativeMotion(), law), d * START / 1e-3, HORIZON)(times) - d * linear)[
            :, :3
        ].max()
        for d in distances
    ]
    assert np.polyfit(np.log(distances), np.log(gaps), 1)[0] == pytest.approx(2.0, abs=0.05)
    assert gaps[0] < 1e-5


@dataclass
class Pendulum(SecondOrder):
    """x'' = -sin x + υ, with an event where x falls below a limit."""

    limit: float = -np.inf
    components: tuple[str, ...] = field(default=("x",))
    scales: None = None

    @property
    def events(self) -> tuple[Event, ...]:
        return (Event("hit", lambda t, x: x[:, 0] - self.limit),) if np.isfinite(self.limit) else ()

    def rates(self, t: np.ndarray, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        del t
        return np.stack([x[:, 1], -np.sin(x[:, 0]) + u[:, 0]], axis=1)


def test_an_event_ends_the_members_that_meet_it() -> None:
    loop = ClosedLoop(Pendulum(-0.5), PD(0.1, 0.05))
    found = ExplicitMemory().solve(loop, np.array([[1.0, 0.0], [0.2, 0.0], [-0.6, 0.0]]), 20.0)
    assert found.status.tolist() == ["hit", "ok", "hit"]
    exact = solve_ivp(
        lambda t, x: [x[1], -np.sin(x[0]) - 0.1 * x[0] - 0.05 * x[1]],
        (0.0, 20.0),
        [1.0, 0.0],
        "DOP853",
        events=lambda t, x: x[0] + 0.5,
        rtol=1e-12,
        atol=1e-12,
    )
    time = exact.t_events[0][0]
    last = found.grid.times[np.isfinite(found.positions[0, 0])][-1]
    assert last == pytest.approx(time, abs=1e-7)
    assert found([last - 1e-3])[0, 0, 0] == pytest.approx(float(np.interp(last - 1e-3, exact.t, exact.y[0])), abs=0.05)
    assert found([last - 1e-9])[0, 0, 0] == pytest.approx(-0.5, abs=1e-7)
    assert np.isnan(found([last + 1e-3])[0]).all()
    assert found.missing.tolist() == [True, False, True]
    assert (found.error_estimate[:2] <= 1e-8).all()
    assert found.end[:2] == pytest.approx([time, 20.0], abs=1e-7)
    assert found.end[2] == 0.0
    np.testing.assert_array_equal(found.events["hit"], [found.end[0], np.nan, 0.0])
    assert np.isnan(found([found.end[0] + 1e-6])[0]).all()


def test_events_that_end_nothing_are_recorded_up_to_the_end() -> None:
    """Against an integrator; `late` comes after the end of the first member, and before time 0 of none."""

    def plant(words: str) -> FunctionPlant:
        events = {
            "hit": Event("hit", lambda t, x: x[:, 0] + 0.5),
            "passed": Event("passed", lambda t, x: x[:, 0] - 0.3, terminal=False),
            "late": Event("late", lambda t, x: 6.0 - t, terminal=False),
        }
        chosen = [events[word] for word in words.split()]
        return FunctionPlant(
            lambda t, x, u: np.stack([x[:, 1], -np.sin(x[:, 0]) + u[:, 0]], axis=1), 2, 1, events=chosen
        )

    start = np.array([[1.0, 0.0], [0.4, 0.0], [0.2, 0.0]])
    found = ExplicitMemory().solve(ClosedLoop(plant("hit passed late"), PD(0.1, 0.05)), start, 8.0)
    assert found.status.tolist() == ["hit", "ok", "ok"]
    assert found.events["late"] == pytest.approx([np.nan, 6.0, 6.0], abs=1e-9, nan_ok=True)
    exact = [
        solve_ivp(
            lambda t, x: [x[1], -np.sin(x[0]) - 0.1 * x[0] - 0.05 * x[1]],
            (0.0, 8.0),
            x0,
            "DOP853",
            events=lambda t, x: x[0] - 0.3,
            rtol=1e-12,
            atol=1e-12,
        ).t_events[0][0]
        for x0 in start[:2]
    ]
    assert found.events["passed"] == pytest.approx([*exact, 0.0], abs=1e-7)
    alone = ExplicitMemory().solve(ClosedLoop(plant("hit"), PD(0.1, 0.05)), start, 8.0)
    np.testing.assert_array_equal(found.positions, alone.positions, err_msg="recording changes nothing")


def test_what_cannot_be_followed_is_never_silently_wrong() -> None:
    explosion = FunctionPlant(lambda t, x, u: np.stack([x[:, 1], 6.0 * x[:, 0] ** 2 + u[:, 0]], axis=1), 2, 1)
    found = ExplicitMemory().solve(
        ClosedLoop(explosion, PDAlpha(0.1, 0.05, 0.8)), np.array([[1.0, 2.0], [-0.01, 0.0]]), 3.0
    )
    assert found.status.tolist() == ["diverged", "ok"]
    assert np.isnan(found.positions[0]).all()
    assert np.isfinite(found.positions[1]).all()
    stiff = ExplicitMemory().solve(ClosedLoop(HCWOutOfPlane(), Damper(3.0, 1.8)), [0.0, 1e-3], 10.0)
    assert stiff.status.item() == "failed"
    assert np.isnan(stiff.positions).all()
    runaway = ExplicitMemory().solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(-3.0, 0.1, 0.9)), [0.0, 1e-3], 10.0)
    assert (runaway.status.item(), runaway.stable.item()) == ("unstable", False)


def test_libration_comes_to_rest() -> None:
    found = solve(ClosedLoop(Libration(), PDAlpha(3.0, 2.0, 0.9)), [0.3, 0.1], 60.0, "explicit_memory")
    assert found.status.item() == "ok"
    assert found.stable.item() is None


def test_a_law_with_integer_orders_takes_even_steps() -> None:
    orders = {
        alpha: ExplicitMemory().solve(ClosedLoop(HCWOutOfPlane(), PDAlpha(1.0, 1.0, alpha)), [0.0, 1.0], 6.0)
        for alpha in (0.9, 1.0)
    }
    assert len(orders[1.0].grid.panels) == 8
    assert len(orders[0.9].grid.panels) > 30


@pytest.mark.parametrize(
    ("loop", "said"),
    [
        (ClosedLoop(Libration(), DelayedFeedback([[0.0, 0.3]], 1.0)), "has delayed states; use 'method_of_steps'"),
        (ClosedLoop(FunctionPlant(lambda t, x, u: x, 3, 1)), "takes plants whose states are m positions"),
        (ClosedLoop(FunctionPlant(lambda t, x, u: x, 2, 1)), "takes plants whose states are m positions"),
        (
            ClosedLoop(HCWOutOfPlane(), Damper(1.0, 2.0)),
            "below 2 of positions and 1 of auxiliary states, but one has 2",
        ),
    ],
)
def test_loops_that_are_refused(loop: ClosedLoop, said: str) -> None:
    with pytest.raises(UnsupportedError, match=said):
        solve(loop, np.zeros(loop.plant.n_states), 1.0, "explicit_memory")


def test_other_solvers_name_this_one() -> None:
    nonlinear = ClosedLoop(RelativeMotion(), PDAlpha(K_P, K_D, ORDERS))
    saturated = ClosedLoop(HCWInPlane(), PDAlpha(np.eye(2), np.eye(2)), Saturation(1.0))
    for loop in (nonlinear, saturated):
        for solver in (Contour(), MethodOfSteps()):
            assert "use 'explicit_memory'" in str(solver.supports(loop))
    assert "use 'method_of_steps'" in str(Contour().supports(ClosedLoop(RelativeMotion())))
    assert "set cross_check to 0" in str(ExplicitMemory(cross_check=0.1).supports(nonlinear))
    with pytest.raises(UnsupportedError, match="takes its gains from a linear plant"):
        ClosedLoop(RelativeMotion(), LQR(np.eye(6), np.eye(3)))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"steps": 0}, "`steps` must be a whole number from 1 to 1000"),
        ({"tolerance": 1e-12}, "`tolerance` must lie in"),
        ({"cross_check": 2.0}, "`cross_check` must lie in"),
    ],
)
def test_options_out_of_range_are_refused(options: dict[str, float], said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        ExplicitMemory(**options)  # type: ignore[arg-type]
