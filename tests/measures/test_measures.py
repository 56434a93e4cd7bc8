"""Measures on random loops against reference measures, and what must not change them."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.errors import ArgumentError
from fracctl.measures import ControlEffort, Measure, Overshoot, SettlingTime
from tests.references import loops, poles
from tests.references.laplace import QuickReference, Reference
from tests.references.loops import Loop
from tests.references.measures import ReferenceMeasures
from tests.references.product import solve

HORIZON = 12.0 * np.pi
OUT_OF_PLANE = list(loops.random_out_of_plane(80, 25))
IN_PLANE = [m for m in loops.random_in_plane(81, 40, spread=2.0) if poles.unstable_count(m) == 0][:12]
BATCHES = [OUT_OF_PLANE, IN_PLANE]


@pytest.fixture(scope="module")
def references() -> dict[int, ReferenceMeasures]:
    return {id(m): ReferenceMeasures(QuickReference(m), HORIZON) for members in BATCHES for m in members}


def is_tangential(reference: ReferenceMeasures, threshold: float) -> bool:
    """Whether an extremum lies so near the threshold that the error of the solver decides."""
    extrema = np.concatenate([reference.extrema(i) for i in range(reference.reference.loop.size)])
    return bool(np.any(np.abs(np.abs(extrema) / threshold - 1.0) < 1e-4))


@pytest.mark.parametrize("members", BATCHES, ids=["out_of_plane", "in_plane"])
@pytest.mark.parametrize("threshold", [1e-4, 1e-5])
def test_settling_times(members: list[Loop], threshold: float, references: dict[int, ReferenceMeasures]) -> None:
    trajectory = solve(members, HORIZON, tolerance=1e-10)
    exact = SettlingTime(threshold)(trajectory)["settling_time"]
    sampled = SettlingTime(threshold, resolution=0.01)(trajectory)["settling_time"]
    assert exact.shape == (len(members),)
    assert np.isfinite(exact).any()
    for value, coarse, member in zip(exact, sampled, members, strict=True):
        reference = references[id(member)]
        if not is_tangential(reference, threshold):
            assert value == pytest.approx(reference.settling_time(threshold), rel=1e-7)
            assert coarse == pytest.approx(reference.sampled_settling_time(threshold), abs=1e-9)


@pytest.mark.parametrize("members", BATCHES, ids=["out_of_plane", "in_plane"])
@pytest.mark.parametrize("definition", ["past_equilibrium", "largest_extremum"])
def test_overshoots(members: list[Loop], definition: str, references: dict[int, ReferenceMeasures]) -> None:
    computed = Overshoot(definition)(solve(members, HORIZON))["overshoot"]
    expected = [references[id(member)].overshoot(definition) for member in members]
    np.testing.assert_allclose(computed, expected, rtol=1e-7)


@pytest.mark.parametrize("members", BATCHES, ids=["out_of_plane", "in_plane"])
def test_control_efforts(members: list[Loop], references: dict[int, ReferenceMeasures]) -> None:
    computed = ControlEffort()(solve(members, HORIZON))["control_effort"]
    np.testing.assert_allclose(computed, [references[id(m)].control_effort() for m in members], rtol=1e-7)


def test_control_effort_where_the_control_begins_steeply() -> None:
    """υ ~ s^(1-α) with α near 1: most of the rise lies below any uniform step."""
    members = [loops.out_of_plane(0.85, 2.0, a, [0.0, 0.002]) for a in (0.5, 0.8, 0.91, 0.97, 0.99, 0.999)]
    for horizon in (0.01, 0.5, HORIZON):
        computed = ControlEffort()(solve(members, horizon))["control_effort"]
        expected = [ReferenceMeasures(QuickReference(m), horizon).control_effort() for m in members]
        np.testing.assert_allclose(computed, expected, rtol=1e-7)


def test_control_effort_with_a_zero_of_the_control_near_the_start() -> None:
    """Gains of opposite sign: υ = -k_P w - k_D D^α w changes sign at small s."""
    members = [
        loops.out_of_plane(4.0, -0.01, 0.9, [0.0, 0.002]),
        loops.out_of_plane(4.0, 1.0, 0.6, [-1e-6, 0.002]),
        loops.out_of_plane(4.0, 1.0, 0.9, [-1e-4, 0.002]),
    ]
    computed = ControlEffort()(solve(members, 6.0))["control_effort"]
    expected = [ReferenceMeasures(QuickReference(m), 6.0).control_effort() for m in members]
    np.testing.assert_allclose(computed, expected, rtol=1e-7)


@pytest.mark.parametrize("members", BATCHES, ids=["out_of_plane", "in_plane"])
def test_measures_do_not_change_with_the_mesh(members: list[Loop]) -> None:
    """Another tolerance or horizon gives other panels and nodes; the settling time stays."""
    coarse, fine, longer = (solve(members, s, t) for s, t in ((HORIZON, 1e-8), (HORIZON, 1e-10), (17.3 * np.pi, 1e-8)))
    assert len(coarse.times) != len(fine.times)
    first, second, third = (SettlingTime(1e-4)(t)["settling_time"] for t in (coarse, fine, longer))
    settled = np.isfinite(first) & (third < HORIZON)
    assert settled.sum() >= len(members) // 2
    np.testing.assert_allclose(first[settled], second[settled], rtol=1e-6)
    np.testing.assert_allclose(first[settled], third[settled], rtol=1e-6)
    np.testing.assert_allclose(
        Overshoot()(coarse)["overshoot"][settled], Overshoot()(longer)["overshoot"][settled], rtol=1e-6
    )


def test_settling_time_at_the_knife_edge() -> None:
    """IC1, α = 1, k = (0.55, 2.0): the second extremum is 9.83e-6, 1.7e-7 below δ, so an error of 1e-8 m decides."""
    member = loops.out_of_plane(0.55, 2.0, 1.0, [0.0, 0.002])
    reference = ReferenceMeasures(Reference(member, 20), HORIZON)
    second = np.sort(np.abs(reference.extrema(0)))[-2]
    assert second == pytest.approx(9.83e-6, abs=6e-9)
    trajectory = solve([member], HORIZON)
    for threshold in (second * (1.0 - 1e-4), second * (1.0 + 1e-4)):
        computed = float(SettlingTime(threshold)(trajectory)["settling_time"][0])
        assert computed == pytest.approx(reference.settling_time(threshold), rel=1e-6)


def test_members_that_never_leave_the_band_settle_at_once() -> None:
    trajectory = solve([loops.out_of_plane(0.85, 2.0, 0.91, [1e-7, 1e-7])], HORIZON)
    assert SettlingTime()(trajectory)["settling_time"][0] == 0.0
    assert SettlingTime(resolution=0.01)(trajectory)["settling_time"][0] == 0.0


def test_monotone_decay_has_no_overshoot() -> None:
    """Critically damped PD from rest never crosses the equilibrium and has no extremum."""
    trajectory = solve([loops.out_of_plane(0.0, 4.0, 1.0, [1e-3, 0.0])], HORIZON)
    for definition in ("past_equilibrium", "largest_extremum"):
        assert Overshoot(definition)(trajectory)["overshoot"][0] == pytest.approx(1.0, abs=1e-7)


def test_overshoot_of_a_damped_oscillator_in_closed_form() -> None:
    """1 + c w₀ exp(-πζ/√(1-ζ²)) past the equilibrium, for a start at rest."""
    zeta = np.array([0.1, 0.3, 0.6])
    members = [loops.out_of_plane(0.0, 2.0 * z, 1.0, [-1e-3, 0.0]) for z in zeta]
    expected = 1.0 + 5e3 * 1e-3 * np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2))
    np.testing.assert_allclose(Overshoot(scale=5e3)(solve(members, 20.0))["overshoot"], expected, rtol=1e-7)


def test_measures_scale_with_the_initial_state() -> None:
    """Linear loops: ten times the start and ten times the band settle together; effort and excursion grow tenfold."""
    one = solve(IN_PLANE, HORIZON)
    ten = solve([m.replace(start=10.0 * m.start) for m in IN_PLANE], HORIZON)
    settled = [SettlingTime(d)(t)["settling_time"] for d, t in ((1e-4, one), (1e-3, ten))]
    np.testing.assert_allclose(settled[0], settled[1], rtol=1e-7)
    efforts = [ControlEffort()(t)["control_effort"] for t in (one, ten)]
    np.testing.assert_allclose(10.0 * efforts[0], efforts[1], rtol=1e-9)
    excursions = [Overshoot()(t)["overshoot"] - 1.0 for t in (one, ten)]
    np.testing.assert_allclose(10.0 * excursions[0], excursions[1], rtol=1e-7, atol=1e-7)


def test_in_plane_settling_is_the_later_component(references: dict[int, ReferenceMeasures]) -> None:
    settled = SettlingTime(2e-4)(solve(IN_PLANE, HORIZON))["settling_time"]
    finite = np.flatnonzero(np.isfinite(settled))
    assert finite.size > 3
    for i in finite:
        reference = references[id(IN_PLANE[i])].reference
        assert np.abs(reference([settled[i]]).position).max() == pytest.approx(2e-4, rel=1e-6)
        assert np.abs(reference(np.linspace(settled[i] + 1e-6, HORIZON, 500)).position).max() < 2e-4


def test_names_and_columns() -> None:
    for measure, name in (
        (SettlingTime(), "settling_time"),
        (Overshoot(), "overshoot"),
        (ControlEffort(), "control_effort"),
    ):
        assert isinstance(measure, Measure)
        assert measure.name == name
        assert measure.columns == (name,)


@pytest.mark.parametrize(
    ("measure", "arguments", "sentence"),
    [
        (SettlingTime, {"threshold": 0.0}, "`threshold` must"),
        (SettlingTime, {"threshold": np.nan}, "`threshold` must"),
        (SettlingTime, {"resolution": -0.01}, "`resolution` must"),
        (Overshoot, {"definition": "largest"}, "`definition` must be one of"),
        (Overshoot, {"scale": 0.0}, "`scale` must"),
    ],
)
def test_measures_refuse_in_sentences(measure: type, arguments: dict, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        measure(**arguments)
