"""The numbers of the paper for its published gains, and numbers measured by an independent program.

Origin: Yaylali, Butcher, Sinclair, out-of-plane and in-plane surveys; the measured ones were computed apart from this
package. Their U and OS are values on samples 0.01 apart (trapezoidal rule, largest sample); where the
control begins as s^(1-α) that sum is off by up to 0.5 %, so exact values stand beside them, from the reference
measures, which agree with adaptive quadrature to 1e-9.
"""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.measures import ControlEffort, Overshoot, SettlingTime
from fracctl.trajectory import Trajectory
from tests.references import loops
from tests.references.laplace import Reference
from tests.references.measures import ReferenceMeasures
from tests.references.product import solve

HORIZON = 12.0 * np.pi
SEARCHED = [[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]]
FRACTIONAL = [[4.1, -1.55, 2.7, 1.05], [3.15, 0.9, 0.9, 2.05]]


def out_of_plane(name: str, alpha: float, k_p: float, k_d: float) -> loops.Loop:
    return loops.out_of_plane(k_p, k_d, alpha, loops.initial_state(name, "w"))


def column(measure: SettlingTime | Overshoot | ControlEffort, trajectory: Trajectory) -> float:
    (values,) = measure(trajectory).values()
    assert values.shape == (1,)
    return float(values[0])


SETTLING = [
    ("ic1", 1.0, 0.55, 2.0, 3.96958, 3.96),
    ("ic1", 0.91, 0.85, 2.0, 3.01276, 3.01),
    ("ic2", 1.0, 0.45, 2.0, 3.52011, 3.52),
    ("ic2", 0.97, 0.75, 1.95, 2.76466, 2.76),
    ("ic3", 1.0, 1.05, 2.0, 3.58862, 3.58),
    ("ic1", 1.0, 2.0, 2.0, 4.12330, 4.12),
    ("ic2", 0.97, 0.80, 2.0, 2.79268, 2.79),
]


@pytest.mark.parametrize(("name", "alpha", "k_p", "k_d", "exact", "sampled"), SETTLING)
def test_settling_times(name: str, alpha: float, k_p: float, k_d: float, exact: float, sampled: float) -> None:
    trajectory = solve([out_of_plane(name, alpha, k_p, k_d)], HORIZON)
    assert column(SettlingTime(), trajectory) == pytest.approx(exact, abs=5.1e-6)
    assert column(SettlingTime(resolution=0.01), trajectory) == pytest.approx(sampled, abs=1e-12)


def test_settling_times_in_orbits() -> None:
    """0.63 T and 0.48 T: the paper's main result, 24 % apart."""
    integer, fractional = (solve([out_of_plane("ic1", *row)], HORIZON) for row in ((1.0, 0.55, 2.0), (0.91, 0.85, 2.0)))
    times = [column(SettlingTime(), t) / (2.0 * np.pi) for t in (integer, fractional)]
    assert times == pytest.approx([0.6318, 0.4795], abs=5e-5)
    assert 1.0 - times[1] / times[0] == pytest.approx(0.24, abs=0.005)


@pytest.mark.parametrize(
    ("name", "alpha", "k_p", "k_d", "exact", "printed", "sampled"),
    [
        ("ic1", 1.0, 0.55, 2.0, 0.00256470, 0.00256, 0.0025648),
        ("ic1", 0.91, 0.85, 2.0, 0.00264975, None, 0.0026380),
        ("ic2", 1.0, 0.45, 2.0, 0.00148333, 0.00148, 0.0014834),
        ("ic2", 0.97, 0.75, 1.95, 0.00147125, 0.00147, 0.0014713),
        ("ic1", 1.0, 2.0, 2.0, 0.00272636, 0.002726, 0.0027264),
        ("ic2", 0.97, 0.80, 2.0, 0.00148057, 0.001480, 0.0014806),
    ],
)
def test_control_efforts(
    name: str, alpha: float, k_p: float, k_d: float, exact: float, printed: float | None, sampled: float
) -> None:
    """The paper prints 2.637e-3 for the second row, where 2.650e-3 is exact: its sum misses υ ~ s^0.09 near 0."""
    trajectory = solve([out_of_plane(name, alpha, k_p, k_d)], HORIZON)
    effort = column(ControlEffort(), trajectory)
    assert effort == pytest.approx(exact, abs=5.1e-9)
    if printed is not None:
        assert 0.0 <= effort - printed < 1e-5
    samples = np.arange(0.0, HORIZON, 0.01)
    assert np.trapezoid(np.abs(trajectory.control(samples)[0, :, 0]), samples) == pytest.approx(sampled, abs=6e-8)


def test_control_effort_depends_on_the_horizon() -> None:
    """IC2 at α = 0.97: the tail υ ~ s^(-α) has no integral, here to about 1e-4."""
    horizons = np.array([4.0, 8.0, 12.0, 16.0, 20.0]) * np.pi
    member = out_of_plane("ic2", 0.97, 0.75, 1.95)
    efforts = [column(ControlEffort(), solve([member], s)) for s in horizons]
    assert efforts == pytest.approx([1.42483e-3, 1.45475e-3, 1.47135e-3, 1.48295e-3, 1.49190e-3], abs=1.2e-7)
    assert efforts == pytest.approx([1.4247221e-3, 1.4546501e-3, 1.4712477e-3, 1.4828498e-3, 1.4917985e-3], rel=1e-7)


@pytest.mark.parametrize(
    ("name", "alpha", "k_p", "k_d", "exact", "printed"),
    [
        ("ic1", 1.0, 2.0, 2.0, 6.87623, 6.87),
        ("ic1", 0.91, 0.85, 2.0, 7.78757, 7.78),
        ("ic2", 1.0, 0.45, 2.0, 1.09249, 1.093),
        ("ic2", 0.97, 0.80, 2.0, 1.06755, 1.067),
    ],
)
def test_overshoots(name: str, alpha: float, k_p: float, k_d: float, exact: float, printed: float) -> None:
    trajectory = solve([out_of_plane(name, alpha, k_p, k_d)], HORIZON)
    overshoot = column(Overshoot(), trajectory)
    assert overshoot == pytest.approx(exact, abs=5.1e-6)
    assert overshoot == pytest.approx(printed, abs=0.01 if printed > 2.0 else 0.001)


def test_the_two_overshoots_differ_for_ic2() -> None:
    """Either side of the equilibrium gives 1.0982 where the paper prints 1.067."""
    trajectory = solve([out_of_plane("ic2", 0.97, 0.80, 2.0)], HORIZON)
    assert column(Overshoot("largest_extremum"), trajectory) == pytest.approx(1.09821, abs=5.1e-6)
    trajectory = solve([out_of_plane("ic2", 0.97, 0.75, 1.95)], HORIZON)
    assert column(Overshoot("largest_extremum"), trajectory) == pytest.approx(1.09866, abs=5.1e-6)


THRESHOLDS_M = [1000.0, 300.0, 100.0, 30.0, 10.0, 1.0]


@pytest.mark.parametrize(
    ("alpha", "k_p", "published"),
    [
        (1.0, 0.55, [0.484, 0.580, 0.632, 1.08, 1.19, 1.62]),
        (0.91, 0.85, [0.382, 0.446, 0.479, 1.32, 2.15, 6.36]),
    ],
)
def test_settling_times_by_threshold(alpha: float, k_p: float, published: list[float]) -> None:
    """Spec 4 section 1, IC1: the algebraic tail of the fractional law costs it the advantage below 100 m."""
    member = out_of_plane("ic1", alpha, k_p, 2.0)
    trajectory = solve([member], 24.0 * np.pi)
    computed = [column(SettlingTime(d / 1e7), trajectory) / (2.0 * np.pi) for d in THRESHOLDS_M]
    for value, printed in zip(computed, published, strict=True):
        assert value == pytest.approx(printed, abs=0.0056 if printed > 1.0 else 0.00056)
    reference = ReferenceMeasures(Reference(member, 20), 24.0 * np.pi)
    assert computed == pytest.approx([reference.settling_time(d / 1e7) / (2.0 * np.pi) for d in THRESHOLDS_M], rel=1e-7)


def test_not_settled_by_the_horizon_is_infinite() -> None:
    trajectory = solve([out_of_plane("ic1", 0.91, 0.85, 2.0)], HORIZON)
    assert column(SettlingTime(1e-7), trajectory) == np.inf
    assert column(SettlingTime(1e-7, resolution=0.01), trajectory) == np.inf


@pytest.mark.parametrize(
    ("gains", "alpha", "settling", "overshoot", "combined"),
    [
        (SEARCHED, [1.0, 1.0], 3.7055, 6.655, 4.966),
        (FRACTIONAL, [0.99, 0.90], None, None, 4.583),
        (FRACTIONAL, [0.98, 0.90], None, None, 4.197),
    ],
)
def test_in_plane_measures(
    gains: list[list[float]], alpha: list[float], settling: float | None, overshoot: float | None, combined: float
) -> None:
    """IC1 with the printed gain matrices of the in-plane survey."""
    trajectory = solve([loops.in_plane(gains, alpha, loops.initial_state("ic1", "uv"))], HORIZON)
    st, os = column(SettlingTime(), trajectory), column(Overshoot("largest_extremum"), trajectory)
    assert np.sqrt(st * os) == pytest.approx(combined, abs=1.1e-3)
    if settling is not None:
        assert st == pytest.approx(settling, abs=5.1e-5)
        assert os == pytest.approx(overshoot, abs=5.1e-4)
