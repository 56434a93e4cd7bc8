"""Engineering units in the configuration: simulated time, thrust bounds, chiefs, starts by orbit elements."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracctl.config.build import build_checked, build_evaluation
from fracctl.config.compose import compose
from fracctl.elements import relative_state
from fracctl.errors import ConfigurationError
from fracctl.evaluation import Evaluation
from fracctl.plants import HCW, Chief

SCALES = Chief().scales
FULL = ["plant=hcw", "controller=pd_alpha_full"]
FLOWN = ["solver=explicit_memory"]


def built(*words: str) -> Evaluation:
    return build_evaluation(compose(words))


def test_the_simulated_time_in_minutes_and_seconds() -> None:
    """One orbit of the paper's chief takes 165.9 min."""
    assert built("horizon_periods=null", "horizon_min=60").horizon == pytest.approx(3600.0 / SCALES.time_s, rel=1e-15)
    assert built("horizon_periods=null", "horizon_s=90").horizon == pytest.approx(90.0 / SCALES.time_s, rel=1e-15)
    assert built("horizon_periods=2").horizon == 4.0 * math.pi


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["horizon_min=60"], "must be given, but horizon_periods and horizon_min are; set horizon_periods=null"),
        (["horizon_periods=null"], "one of horizon_periods, horizon_min, horizon_s must be given, but none"),
        (["plant=linear", "controller=pd_alpha_own", "initial_condition=own", "initial_condition.own.x=1",
          "horizon_periods=null", "horizon_s=5"],
         "horizon_s = 5: needs a plant with units; give horizon_periods instead"),
        ([*FLOWN, "evaluation.largest_control=1e-3", "evaluation.largest_acceleration_mm_s2=4"],
         "evaluation.largest_acceleration_mm_s2 = 4: a second bound beside evaluation.largest_control; keep one"),
        ([*FLOWN, "spacecraft.thrust_n=1"], "spacecraft.thrust_n = 1: needs a mass; set spacecraft.mass_kg"),
        (["spacecraft.mass_kg=-1"], "spacecraft.mass_kg = -1: must be above 0"),
        (["evaluation=accuracy", "figures=[]", "spacecraft.thrust_n=1", "spacecraft.mass_kg=1"],
         "spacecraft.thrust_n = 1: plays no part with evaluation.type = accuracy"),
        (["initial_condition=own", "initial_condition.own.units=elements"], "initial_condition.own: nothing moves"),
        (["initial_condition=own", "initial_condition.own.units=elements", "+initial_condition.own.w=1"],
         "unknown key 'initial_condition.own.w'"),
        (["plant=linear", "controller=pd_alpha_own", "initial_condition=own", "initial_condition.own.units=elements",
          "+initial_condition.own.delta_a_km=1"],
         "initial_condition.own.units = elements: needs a plant with a chief on an orbit; give its states"),
    ],
)  # fmt: skip
def test_what_is_refused(words: list[str], sentence: str) -> None:
    with pytest.raises(ConfigurationError) as found:
        build_checked(compose(words))
    assert sentence in str(found.value)


def test_bounds_in_three_units_are_the_same() -> None:
    """500 kg under 4 N bear 8 mm/s², 2.007e-3 of the paper's r n²."""
    dimensionless = 8e-3 / SCALES.acceleration_m_s2
    for words in (
        [f"evaluation.largest_control={dimensionless}"],
        ["evaluation.largest_acceleration_mm_s2=8"],
        ["spacecraft.thrust_n=4", "spacecraft.mass_kg=500"],
    ):
        limit = built(*FLOWN, *words, "evaluation.largest_by=axis").saturation
        assert limit is not None
        assert limit.limit.item() == pytest.approx(dimensionless, rel=1e-14)
        assert limit.by == "axis"
    assert built("spacecraft.mass_kg=500").saturation is None


def test_starts_by_orbit_elements() -> None:
    """IC3's differences, exact, whole and in parts; the linearised map is another number."""
    degree = math.pi / 180.0
    differences = [80.0 / 1e4, 0.05 * degree, -0.1 * degree, 0.007, 0.0, -0.17 * degree]
    whole = relative_state(HCW().chief_elements, differences)
    found = built(*FULL, "initial_condition=ic3_elements").initial_conditions["ic3_elements"]
    np.testing.assert_allclose(found, whole, rtol=1e-13)
    part = built("initial_condition=ic3_elements").initial_conditions["ic3_elements"]
    np.testing.assert_allclose(part, whole[[2, 5]], rtol=1e-13)
    words = ["initial_condition=ic3_elements", "initial_condition.ic3_elements.linearised=true"]
    linear = built(*FULL, *words).initial_conditions["ic3_elements"]
    np.testing.assert_allclose(linear, [0.001, -0.0019154, 0.0010148, 0.0, 0.002, -0.0017453], atol=1e-7)


def test_elements_about_an_elliptic_leader() -> None:
    """A follower that is 1 km behind on the same orbit, at perigee: δθ = -1 km / r, rates of the turning frame 0."""
    words = [
        "experiment=nonlinear_ic1",
        "initial_condition=own",
        "plant.eccentricity=0.1",
        "initial_condition.own.units=elements",
    ]
    angle = -1.0 / 9000.0 * 180.0 / math.pi
    config = compose([*words, f"+initial_condition.own.delta_argument_of_latitude_deg={angle}"])
    state = build_evaluation(config).initial_conditions["own"]
    np.testing.assert_allclose(state[:3], [0.0, -1e-4, 0.0], atol=1e-8)
    assert abs(state[4]) < 2e-8


def test_a_chief_by_its_altitude() -> None:
    plant = built("plant.chief.semi_major_axis_km=null", "plant.chief.altitude_km=400").plant
    assert plant.scales == Chief(6778.137).scales
