"""Memories chosen from a tolerance keep it, and shorter ones do not."""

from __future__ import annotations

import numpy as np
import pytest

import fracctl as fc
from fracctl.controllers import PD, PDAlpha, PILambdaDMu
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.plants import HCWOutOfPlane
from fracctl.sampled import (
    Exponentials,
    Oustaloup,
    Window,
    choose_memory,
    loop_band,
    memory_for,
    memory_orders,
    response_error,
)
from fracctl.sampled.tolerance import Kind
from fracctl.sampled.window import MOST_SAMPLES

BAND = (0.3, 20.0)
PERIOD = 0.01


@pytest.mark.parametrize("order", [0.91, 0.6, -0.3])
@pytest.mark.parametrize("tolerance", [0.1, 0.05])
def test_a_window_is_as_long_as_it_must_be(order: float, tolerance: float) -> None:
    found = choose_memory("window", [order], PERIOD, BAND, tolerance)
    assert isinstance(found, Window)
    assert response_error(found, order, PERIOD, BAND) <= tolerance
    assert response_error(Window(found.samples - 1), order, PERIOD, BAND) > tolerance


@pytest.mark.parametrize("order", [0.91, -0.3])
def test_a_window_against_the_filter_that_it_is(order: float) -> None:
    """The response of the state space itself, and of Grünwald and Letnikov's whole sum."""
    omega = np.logspace(np.log10(BAND[0]), np.log10(BAND[1]), 81)
    window = Window(60)
    operator = window.derivative(order, PERIOD) if order > 0.0 else window.integral(-order, PERIOD)
    whole = ((1.0 - np.exp(-1j * omega * PERIOD)) / PERIOD) ** order
    expected = np.abs(operator.response(omega * PERIOD) / whole - 1.0).max()
    assert response_error(window, order, PERIOD, BAND) == pytest.approx(expected, rel=1e-9)


def test_a_long_window_forgets_as_its_tail_says() -> None:
    """The tail of I^(1-α) beyond L is (ωL)^(-α)/Γ(1-α) of the whole where ωL is large."""
    from scipy.special import rgamma

    alpha, samples = 0.5, 20000
    found = response_error(Window(samples), alpha, PERIOD, (1.0, 1.001))
    assert found == pytest.approx((samples * PERIOD) ** -alpha * rgamma(1.0 - alpha), rel=0.02)


@pytest.mark.parametrize("kind", ["oustaloup", "exponentials"])
@pytest.mark.parametrize("tolerance", [0.1, 0.01, 1e-3])
def test_filters_and_modes_keep_the_tolerance(kind: Kind, tolerance: float) -> None:
    memory = choose_memory(kind, [0.91], PERIOD, BAND, tolerance)
    operator = memory.derivative(0.91, PERIOD)
    omega = np.logspace(np.log10(BAND[0]), np.log10(BAND[1]), 200)
    lines = Exponentials(1e5, 1e-10).derivative(0.91, PERIOD).response(omega * PERIOD)
    found = np.abs(operator.response(omega * PERIOD) / lines - 1.0).max()
    # Oustaloup's filter is compared before it is sampled: lines between samples smooth both by (ωh)²/12
    assert found <= 1.05 * tolerance + (3.5e-3 if kind == "oustaloup" else 0.0)


def test_all_orders_count() -> None:
    law = PILambdaDMu(1.0, 0.1, 2.0, 0.3, 0.9)
    assert memory_orders(law.linear_terms(1)) == [-0.3, 0.9]
    assert memory_orders(law.linear_terms(1), "velocity") == pytest.approx([-0.3, -0.1])
    assert memory_orders(PD(1.0, 1.0).linear_terms(1)) == []
    memory = choose_memory("oustaloup", [-0.3, 0.9], PERIOD, BAND, 0.01)
    assert isinstance(memory, Oustaloup)
    assert max(response_error(memory, order, PERIOD, BAND) for order in (-0.3, 0.9)) <= 0.01


def test_the_band_lies_around_the_crossover() -> None:
    loop = fc.ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91))
    low, high = loop_band(loop)
    assert np.sqrt(low * high) == pytest.approx(fc.stability.margins(loop).crossover)
    assert high / low == pytest.approx(100.0)
    with pytest.raises(UnsupportedError, match="give a band"):
        loop_band(fc.ClosedLoop(HCWOutOfPlane(), PD(0.0, 0.0)))


def test_a_window_may_be_as_long_as_the_longest() -> None:
    longest = response_error(Window(MOST_SAMPLES), 0.91, PERIOD, BAND)
    found = choose_memory("window", [0.91], PERIOD, BAND, longest * 1.0001)
    assert isinstance(found, Window)
    assert 2**14 < found.samples <= MOST_SAMPLES  # doubling alone would end at the first
    with pytest.raises(ArgumentError, match=f"with {MOST_SAMPLES} samples"):
        choose_memory("window", [0.91], PERIOD, BAND, 0.99 * longest)
    with pytest.raises(ArgumentError, match="at most"):
        Window(MOST_SAMPLES + 1)


def test_the_memory_for_a_loop() -> None:
    loop = fc.ClosedLoop(HCWOutOfPlane(), PDAlpha(0.85, 2.0, 0.91))
    memory = memory_for(loop, "exponentials", PERIOD, 0.02, "velocity")
    assert response_error(memory, -0.09, PERIOD, loop_band(loop)) <= 0.02
    assert isinstance(memory_for(fc.ClosedLoop(HCWOutOfPlane(), PD(0.55, 2.0)), "oustaloup", PERIOD, 0.02), Window)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"kind": "taps"}, "kind"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"orders": [1.0]}, "orders"),
        ({"orders": []}, "orders"),
        ({"band": (2.0, 1.0)}, "band"),
        ({"kind": "window", "tolerance": 1e-6}, "tolerance"),
    ],
)
def test_refusals(change: dict[str, object], name: str) -> None:
    given = {"kind": "oustaloup", "orders": [0.5], "period": PERIOD, "band": BAND, "tolerance": 0.1} | change
    with pytest.raises(ArgumentError, match=f"`{name}`"):
        choose_memory(**given)  # type: ignore[arg-type]
