"""Laws on board: what they answer, how much they remember, and what cannot be sampled."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from fracctl.controllers import PD, PID, LinearLaw, PDAlpha, PDDAlpha, PDLag, PILambdaDMu
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.plants import HCWInPlane, HCWOutOfPlane, LinearPlant
from fracctl.sampled import Exponentials, Oustaloup, SampledLaw, Window, dimensionless_time

STEP = 1e-3
FINE = Exponentials(100.0, 1e-6)
LAWS = [
    (PD(0.55, 2.0), lambda s: 0.55 + 2.0 * s),
    (PDAlpha(0.85, 2.0, 0.91), lambda s: 0.85 + 2.0 * s**0.91),
    (PDDAlpha(0.85, 0.3, 2.0, 0.7), lambda s: 0.85 + 0.3 * s + 2.0 * s**0.7),
    (PDLag(1.3, 2.0, 0.22), lambda s: 1.3 + 2.0 * s / (0.22 * s + 1.0)),
    (PID(1.0, 0.4, 2.0, 0.1), lambda s: 1.0 + 0.4 / s + 2.0 * s / (0.1 * s + 1.0)),
    (PILambdaDMu(1.0, 0.4, 2.0, 0.6, 0.8), lambda s: 1.0 + 0.4 * s**-0.6 + 2.0 * s**0.8),
    (PILambdaDMu(1.0, 0.4, 2.0, 1.0, 1.0), lambda s: 1.0 + 0.4 / s + 2.0 * s),
]


@pytest.mark.parametrize("feed", ["position", "velocity"])
@pytest.mark.parametrize(("law", "transfer"), LAWS, ids=lambda law: type(law).__name__)
def test_the_response_is_that_of_the_law(law: LinearLaw, transfer: object, feed: str) -> None:
    omega = np.array([0.3, 1.0, 3.0])
    response = SampledLaw(law, FINE, STEP, feed=feed).discrete(1).response(STEP * omega)  # type: ignore[arg-type]
    found = response[:, 0, 0] + 1j * omega * response[:, 0, 1]
    np.testing.assert_allclose(found, -transfer(1j * omega), rtol=2e-3)  # type: ignore[operator]


def test_gains_of_two_controls_stand_where_the_law_has_them() -> None:
    k_p, k_d = np.array([[4.0, -1.35], [3.15, 0.4]]), np.array([[2.4, 0.65], [0.7, 1.95]])
    omega, law = np.array([0.7]), PDAlpha(k_p, k_d, [0.99, 0.9])
    response = SampledLaw(law, FINE, STEP).discrete(2).response(STEP * omega)[0]
    np.testing.assert_allclose(response[:, :2], -k_p - k_d * (0.7j ** np.array([0.99, 0.9])), rtol=2e-3)
    np.testing.assert_array_equal(response[:, 2:], 0.0)


def test_states_and_operations_are_those_of_the_sums() -> None:
    law = PDAlpha(0.85, 2.0, 0.91)
    window = SampledLaw(law, Window(100), STEP).discrete(1)
    assert (window.n_states, window.operations) == (99, 100)
    oustaloup = SampledLaw(law, Oustaloup(0.1, 10.0, 5), STEP).discrete(1)
    assert (oustaloup.n_states, oustaloup.operations) == (5, 5 + 5 + 5 + 1)
    assert SampledLaw(PD(1.0, 1.0), Window(9), STEP, feed="velocity").discrete(1).n_states == 0


def test_a_window_of_thousands_of_samples_on_three_axes_takes_little_memory() -> None:
    law, samples = PDAlpha(np.eye(3), np.eye(3), [0.9, 0.9, 0.9]), 8000
    tracemalloc.start()
    controller = SampledLaw(law, Window(samples), STEP, feed="velocity").discrete(3)
    states = controller.start(np.ones((1, 6)))
    for _ in range(50):
        states, control = controller.step(states, np.ones((1, 6)))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert controller.n_states == 3 * (samples - 1)
    weights = np.cumprod(np.append(1.0, 1.0 + (0.1 - 1.0) / np.arange(1, 50)))
    np.testing.assert_allclose(control, np.full((1, 3), -1.0 - STEP**0.1 * weights.sum()), rtol=1e-12)
    assert peak < 50e6  # its matrix with all zeros would take 4.6e9


def test_a_recorded_memory_goes_on_where_it_was() -> None:
    controller = SampledLaw(PDAlpha(0.85, 2.0, 0.91), Window(30), STEP).discrete(1)
    rng = np.random.default_rng(3)
    told = rng.standard_normal((2, 50, 2))
    states = controller.start(told[:, 0])
    for k in range(50):
        states, control = controller.step(states, np.ascontiguousarray(told[:, k]))
    recorded = controller.start(told[:, -1], told[:, :-1])
    np.testing.assert_array_equal(controller.step(recorded, np.ascontiguousarray(told[:, -1]))[1], control)


def test_only_integrals_integrate() -> None:
    pid = SampledLaw(PID(1.0, 0.4, 2.0, 0.1), FINE, STEP).discrete(1)
    assert pid.integral_of.tolist() == [0, -1]
    assert (SampledLaw(PDAlpha(1.0, 1.0, 0.5), FINE, STEP).discrete(1).integral_of == -1).all()


def test_seconds() -> None:
    plant = HCWOutOfPlane()
    assert dimensionless_time(plant, 10.0) == pytest.approx(6.3134e-3, rel=1e-4)
    with pytest.raises(UnsupportedError, match="unit of time"):
        dimensionless_time(LinearPlant(-1.0), 10.0)
    assert HCWInPlane().scales is not None


@pytest.mark.parametrize(
    ("options", "name"),
    [({"period": 0.0}, "period"), ({"delay": -1.0}, "delay"), ({"feed": "rate"}, "feed")],
)
def test_refused_arguments(options: dict[str, object], name: str) -> None:
    given = {"law": PD(1.0, 1.0), "memory": FINE, "period": 0.1} | options
    with pytest.raises(ArgumentError, match=f"`{name}`"):
        SampledLaw(**given)  # type: ignore[arg-type]


def test_a_batch_of_laws_is_refused() -> None:
    with pytest.raises(UnsupportedError, match="batch of 2"):
        SampledLaw(PD([1.0, 2.0], 1.0), FINE, 0.1).discrete(1)
