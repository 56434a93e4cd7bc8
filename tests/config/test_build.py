"""From a configuration to the objects of a run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracctl.config.build import build_checked, build_evaluation, build_survey
from fracctl.config.compose import compose
from fracctl.config.schemas import RunConfig
from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.plants import Chief


def build(*words: str) -> RunConfig:
    return compose(words)


def test_the_numbers_arrive() -> None:
    words = [
        "horizon_periods=2",
        "controller.alpha_w=0.9",
        "plant.chief.semi_major_axis_km=7000",
        "solver.tolerance=1e-6",
    ]
    evaluation = build_evaluation(build(*words))
    assert evaluation.horizon == 4 * math.pi
    assert evaluation.parameters == {"alpha_w": 0.9, "k_p_w": 0.55, "k_d_w": 2.0}
    assert evaluation.plant.scales == Chief(7000.0).scales
    assert evaluation.solver.tolerance == 1e-6
    assert evaluation.objectives["st_os_u"] == ("settling_time", "overshoot", "control_effort")


def test_initial_conditions_take_their_components() -> None:
    states = build_evaluation(build("initial_condition=[ic2,ic3]")).initial_conditions
    assert {name: state.tolist() for name, state in states.items()} == {"ic2": [-0.001, 0.0], "ic3": [0.001, -0.002]}
    words = ["plant=hcw_in_plane", "controller=pd_alpha_in_plane"]
    assert build_evaluation(build(*words)).initial_conditions["ic1"].tolist() == [-0.001, 0.0, 0.0, 0.002]


def test_metres_become_dimensionless() -> None:
    own = ["units=si", "u=100", "v=200", "w=300", "u_dot=1", "v_dot=2", "w_dot=3"]
    words = ["plant=hcw", "controller=pd_alpha_full", "initial_condition=own"]
    state = build_evaluation(build(*words, *(f"initial_condition.own.{word}" for word in own))).initial_conditions[
        "own"
    ]
    scales = Chief().scales
    expected = [100 / 1e7, 200 / 1e7, 300 / 1e7, *(np.array([1, 2, 3]) / scales.speed_m_s)]
    np.testing.assert_allclose(state, expected, rtol=1e-15)


def test_a_single_survey_is_the_controller_as_it_stands() -> None:
    config = build("controller.alpha_w=0.9")
    (block,) = build_survey(config, build_evaluation(config)).ask()
    assert {name: values.tolist() for name, values in block.design.items()} == {
        "alpha_w": [0.9], "k_p_w": [0.55], "k_d_w": [2.0]
    }  # fmt: skip


def test_a_grid_holds_both_ends_and_rounded_values() -> None:
    config = build(
        "survey=out_of_plane", "survey.axes.alpha_w=0.9:1.0:0.01", "~survey.axes.k_p_w", "controller.k_p_w=0.7"
    )
    survey = build_survey(config, build_evaluation(config))
    designs = [block.design for blocks in iter(survey.ask, []) for block in blocks]
    orders = np.unique(np.concatenate([design["alpha_w"] for design in designs]))
    assert orders.tolist() == [0.9, 0.91, 0.92, 0.93, 0.94, 0.95, 0.96, 0.97, 0.98, 0.99, 1.0]
    assert {value for design in designs for value in design["k_p_w"].tolist()} == {0.7}
    assert survey.n_points == 11 * 41
    assert survey.baseline == {"alpha_w": 1.0}


def test_a_pd_law_has_no_order() -> None:
    evaluation = build_evaluation(build("controller=pd"))
    assert evaluation.design_variables == ("k_p_w", "k_d_w")
    pd = evaluation({"k_p_w": np.array([0.55]), "k_d_w": np.array([2.0])})
    alpha = build_evaluation(build())({"alpha_w": np.array([1.0])})
    assert pd["settling_time"].tolist() == alpha["settling_time"].tolist()


def test_a_loop_that_the_solver_does_not_take(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fracctl.solvers.Contour.supports", lambda self, loop: "linear loops only; use 'other'")
    with pytest.raises(ConfigurationError, match="contour: linear loops only; use 'other'"):
        build_checked(build())


def test_the_cure_of_a_loop_that_cannot_be_built_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: object, loop: object) -> None:
        raise ArgumentError("k_p_w", 9.0, "must be below 5", "take a gain of 4")

    monkeypatch.setattr("fracctl.solvers.Contour.supports", refuse)
    with pytest.raises(ConfigurationError, match=r"^controller.k_p_w = 9.0: must be below 5; take a gain of 4$"):
        build_checked(build())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["experiment=flight_ic1", "survey=search"], "survey.type = search: optimises an objective, but evaluation"),
        (["experiment=tether", "survey=search"], "survey.type = search: several laws have their own values"),
        (
            ["experiment=fair_outofplane", "plant=linear", "plant.components=[w]", "initial_condition=own",
             "initial_condition.own.w=1"],
            "plant = LinearPlant: must have units, for limits are in SI; set plant.scales, or take plant=hcw",
        ),
        (
            ["evaluation=flight", "measures=standard", "plant=linear", "plant.components=[w]", "initial_condition=own",
             "initial_condition.own.w=1", "figures=null"],
            "; set plant.scales",
        ),
    ],
)  # fmt: skip
def test_what_does_not_go_together_is_told_with_its_cure(words: list[str], said: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        build_checked(build(*words))
    assert said in str(refused.value)
