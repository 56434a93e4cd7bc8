"""Designs over dispersed starts, against every start solved for itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

import fracctl as fc
from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.dispersions import draws
from fracctl.errors import ConfigurationError
from fracctl.flight import FlightEvaluation, RobustEvaluation
from fracctl.flight.uncertain import starts
from fracctl.measures import settling_time

WORDS = ["experiment=flight_design", "evaluation.samples=20", "figures=[]"]
DESIGN = {"alpha_w": np.array([0.91, 1.0]), "k_p_w": np.array([0.85, 0.55]), "k_d_w": np.array([2.0, 2.0])}


def built(words: list[str]) -> RobustEvaluation:
    found = build_checked(compose([*WORDS, *words]))[0]
    assert isinstance(found, RobustEvaluation)
    return found


def test_a_row_is_the_quantile_of_its_starts() -> None:
    evaluation = built(["evaluation.quantile=0.9"])
    rows = evaluation(DESIGN)
    drawn = draws(evaluation.dispersions, evaluation._known, 0, range(20))
    states = starts(evaluation.plant, np.array([0.0, 0.002]), drawn, (0.001, math.sqrt(8.0) * 1e-3))
    for place in range(2):
        law = fc.controllers.PDAlpha(*(DESIGN[name][place] for name in ("k_p_w", "k_d_w", "alpha_w")))
        times = [
            settling_time(fc.solve(fc.ClosedLoop(evaluation.plant, law), state, evaluation.horizon)) for state in states
        ]
        assert rows["settling_time_100_m"][place] == pytest.approx(np.sort(times)[17], rel=1e-7), "18 of 20"
        assert rows["objective"][place] == rows["settling_time_100_m"][place]


def test_a_search_does_not_choose_whom_to_leave_out() -> None:
    """Designs for flights count by all of their starts."""
    evaluation = built([])
    assert evaluation.quantile == 1.0
    worst = max(evaluation._each({name: values[:1] for name, values in DESIGN.items()})["settling_time_100_m"])
    assert evaluation(DESIGN)["settling_time_100_m"][0] == pytest.approx(worst, rel=1e-12)


def test_the_largest_is_the_quantile_of_all() -> None:
    most, nearly = built(["evaluation.quantile=1"])(DESIGN), built(["evaluation.quantile=0.5"])(DESIGN)
    assert (most["settling_time_100_m"] > nearly["settling_time_100_m"]).all()


def test_other_samples_are_other_starts() -> None:
    one, other = built([])(DESIGN), built(["evaluation.first_sample=20"])(DESIGN)
    assert (one["settling_time_100_m"] != other["settling_time_100_m"]).all()


def test_enough_starts_decide_on_the_status() -> None:
    """A short horizon leaves some starts outside the band; a quantile that they do not reach does not see them."""
    words = ["horizon_periods=0.63", "evaluation.samples=40", "constraints={}"]
    some = built([*words, "evaluation.quantile=0.02"])(DESIGN)
    every = built([*words, "evaluation.quantile=1"])(DESIGN)
    assert some["status"].tolist()[1] == "ok"
    assert every["status"].tolist()[1] == "unsettled"
    assert np.isinf(every["objective"][1])


def test_constraints_hold_for_the_quantile() -> None:
    peak = built([])(DESIGN)["peak_acceleration_mm_s2"]
    bound = float(peak.mean())
    rows = built([f"constraints.peak_acceleration_mm_s2='<= {bound}'"])(DESIGN)
    assert (rows["status"] == "beyond_limits").tolist() == (peak > bound).tolist()
    assert peak.min() < bound < peak.max()


def test_unstable_designs_are_told_apart() -> None:
    rows = built([])({name: np.array([value]) for name, value in (("alpha_w", 1.0), ("k_p_w", -3.0), ("k_d_w", 1.0))})
    assert rows["status"].tolist() == ["unstable"]
    assert rows["stable"].tolist() == [False]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["evaluation.dispersions={offset_w_percent: null, offset_w_dot_percent: null}"], "must hold at least one"),
        (["+evaluation.dispersions.mass_kg=[normal, 500, 1]"], "evaluation.dispersions = mass_kg: must be one of"),
        (["evaluation.quantile=0"], "evaluation.quantile = 0"),
        (["evaluation.dispersions.offset_w_percent=[normal, 0]"], "must hold 'normal' and 2 or 4 numbers"),
    ],
)
def test_refusals(words: list[str], sentence: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        built(words)
    assert sentence in str(caught.value)


@pytest.mark.parametrize("start", ["ic1", "ic2", "ic3"])
@pytest.mark.parametrize(
    ("experiment", "controller", "states"),
    [("flight_design", "lqr", [2, 5]), ("flight_design_inplane", "lqr", [0, 1, 3, 4])],
)
def test_designs_meet_the_starts_of_their_tests(
    start: str, experiment: str, controller: str, states: list[int]
) -> None:
    """Per cents are of the whole start, of which the plant of a design takes a part: IC1's w begins at 0, not w'."""
    flown = build_checked(compose([f"experiment=flight_{start}"]))[0]
    assert isinstance(flown, FlightEvaluation)
    words = [f"experiment={experiment}", f"controller={controller}", f"initial_condition=[{start}]"]
    design = build_checked(compose([*words, "evaluation.samples=3"]))[0]
    assert isinstance(design, RobustEvaluation)
    numbers = draws(design.dispersions, design._known, 0, range(200))
    nominal = design.initial_conditions[start]
    of_design = starts(design.plant, nominal, numbers, design.sizes[start]) - nominal
    drawn = flown.around.drawn(np.arange(200.0))
    met = flown.around.of("dispersed", flown.initial_conditions[start], drawn, 200, flown.sizes[start])
    of_test = met.states[:, states] - flown.initial_conditions[start][states]
    for place, name in enumerate(design.plant.state_names):
        of_one = {which: drawn_[f"offset_{name}_percent"] for which, drawn_ in (("design", numbers), ("test", drawn))}
        np.testing.assert_allclose(
            of_design[:, place] / of_one["design"], of_test[:, place] / of_one["test"], rtol=1e-9, err_msg=name
        )
    own = design._each.initial_conditions
    np.testing.assert_allclose(np.array(list(own.values())) - nominal, of_design[:3], rtol=1e-12)


def test_per_cents_are_of_starts_by_orbit_elements_and_in_metres() -> None:
    whole = dict.fromkeys(("u", "v", "w", "u_dot", "v_dot", "w_dot"), 0.0) | {
        "u": 3000.0,
        "w": 4000.0,
        "v_dot": 6.0,
    }
    words = ["initial_condition=own", *(f"+initial_condition.own.{name}={value}" for name, value in whole.items())]
    in_metres = built([*words, "initial_condition.own.units=si"])
    scales = in_metres.plant.scales
    assert scales is not None
    assert in_metres.sizes["own"] == pytest.approx((5000.0 / scales.length_m, 6.0 / scales.speed_m_s))
    by_elements = built(["initial_condition=ic3_elements"])
    three = build_checked(compose(["plant=hcw", "controller=lqr", "initial_condition=ic3_elements"]))[0]
    state = three.initial_conditions["ic3_elements"]
    assert by_elements.sizes["ic3_elements"] == pytest.approx((np.linalg.norm(state[:3]), np.linalg.norm(state[3:])))
