"""The schema of a run: every error at once, in one form, with ranges."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from fracctl.config.compose import compose
from fracctl.config.messages import InvalidConfiguration, problems
from fracctl.config.registry import names
from fracctl.config.schemas import RunConfig

CONTROLLERS = ", ".join(names("controllers"))
LINEAR = ("plant=linear", "controller=pd_alpha_own", "initial_condition=own", "initial_condition.own.x=1")


def said(*words: str) -> list[str]:
    with pytest.raises(InvalidConfiguration) as caught:
        compose(words)
    return list(caught.value.problems)


def plain(*words: str) -> dict[str, Any]:
    return compose(words).model_dump(mode="json")


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["experiment=outofplane"],
        ["plant=hcw", "controller=pd_alpha_full", "figures=null"],
        [*LINEAR, "plant.scales={length_m: 2, time_s: 3}", "initial_condition.own.units=si"],
        ["plant=linear", *LINEAR[1:3], "plant.stiffness=[[-1,0],[0,-2]]", "plant.damping=[[0,1],[-1,0]]",
         "plant.components=[a,b]", "initial_condition.own.a=1", "controller.k_p_ab=2"],
    ],
)  # fmt: skip
def test_plain_data_give_the_same_configuration(words: list[str]) -> None:
    config = compose(words)
    again = RunConfig.model_validate(config.model_dump(mode="json"))
    assert again == config
    assert again.model_dump(mode="json") == config.model_dump(mode="json")


def test_defaults_are_written_out() -> None:
    assert plain("measures.control_effort=null")["measures"]["control_effort"] == {"resolution": None}
    assert plain("~measures.overshoot.scale")["measures"]["overshoot"]["scale"] == 1e4


def test_all_errors_come_at_once() -> None:
    assert said("controller.alpha_w=1.3", "solver.tolerance=2", "seed=-1", "objective=speed", "foo=1")[:4] == [
        "controller.alpha_w = 1.3: must lie in (0, 1]",
        "solver.tolerance = 2: must lie in [1e-11, 1e-3]",
        "objective = speed: must be one of the run's objectives (settling_time, st_os_u)",
        "seed = -1: must be at least 0",
    ]


TLS = ["scheduler=dask", *(f"scheduler.tls_{name}=a.pem" for name in ("ca_file", "client_cert", "client_key"))]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["controller.alpha_w=0"], "controller.alpha_w = 0: must lie in (0, 1]"),
        (["controller.k_p_w=nan"], "controller.k_p_w = nan: must be a finite number"),
        (["controller.k_p_w=inf"], "controller.k_p_w = inf: must be a finite number"),
        (["controller.k_p_w=true"], "controller.k_p_w = true: must be a number"),
        (["controller.k_p_w='1'"], "controller.k_p_w = 1: must be a number"),
        (["controller.k_p_w=null"], "controller.k_p_w = null: must be a number"),
        (["controller.type=pdx"], f"controller.type = pdx: must be one of {CONTROLLERS}; did you mean 'pd'?"),
        (["plant.type=moon"], f"plant.type = moon: must be one of {', '.join(names('plants'))}"),
        (["plant.chief.semi_major_axis_km=-1"], "plant.chief.semi_major_axis_km = -1: must be positive"),
        (["plant.chief.mass=1"], ("unknown key 'plant.chief.mass'; allowed: semi_major_axis_km, inclination_deg, "
                                 "gravitational_parameter_km3_s2, altitude_km, raan_deg, argument_of_latitude_deg")),
        (["plant.chief.altitude_km=500"], ("plant.chief.altitude_km = 500: must not be given beside semi_major_axis_km "
                                          "= 10000; set one of the two to null")),
        (["plant.chief=5"], "plant.chief = 5: must be a mapping of options"),
        ([*LINEAR, "plant.damping=[[1,2],[3,4]]"],
         "plant.damping = [[1, 2], [3, 4]]: must have the shape of `stiffness`, (1, 1), but is of shape (2, 2)"),
        ([*LINEAR, "plant.stiffness=[1,a]"],
         "plant.stiffness = [1, a]: must be a number, or a matrix as a list of rows"),
        ([*LINEAR, "plant.components=x"], "plant.components = x: must be a list"),
        ([*LINEAR, "plant.scales={length_m: 1}"], "plant.scales.time_s is missing"),
        ([*LINEAR, "initial_condition.own.units=si"],
         "initial_condition.own.units = si: needs a plant with scales; set plant.scales, or give dimensionless values"),
        (["initial_condition=own", "initial_condition.own.units=km", "initial_condition.own.w=1"],
         "initial_condition.own.units = km: must be 'dimensionless', 'si' or 'elements'"),
        (["initial_condition=own", "initial_condition.own.x=1"], ("unknown key 'initial_condition.own.x'; allowed: "
         "units, u, v, w, u_dot, v_dot, w_dot")),
        (["measures.settling_tim={}"], "unknown key 'measures.settling_tim'; did you mean 'measures.settling_time'?"),
        (["measures.settling_time.threshold=0"], "measures.settling_time.threshold = 0: must be positive"),
        (["objectives.fast=[]"], "objectives.fast = []: must name at least one measure"),
        (["objectives.fast=[settling_tim]"], ("objectives.fast = [settling_tim]: must name measures of this run "
         "(settling_time, overshoot, control_effort); did you mean 'settling_time'?")),
        (["objectives.a-b=[overshoot]"], "objectives.a-b: an objective's name consists of letters, digits and '_'"),
        (["horizon_periods=0"], "horizon_periods = 0: must be above 0"),
        (["name=a/b"], "name = a/b: must be a name of letters, digits, '_', '-' and '.'"),
        (["name=.."], "name = ..: must be a name of letters, digits, '_', '-' and '.'"),
        (["output_dir="], "output_dir = '': must be the path of a directory"),
        (["scheduler=local", "scheduler.workers=0"], "scheduler.workers = 0: must be at least 1"),
        (["scheduler=local", "scheduler.workers=1.5"], "scheduler.workers = 1.5: must be a whole number"),
        (["scheduler.workers=2"], "unknown key 'scheduler.workers'; allowed: type"),
        (["scheduler.type=lokal"], "scheduler.type = lokal: must be one of serial, local, dask; did you mean 'local'?"),
        (["scheduler=dask", "scheduler.address=localhost"], ("scheduler.address = localhost: must be "
         "tcp://HOST:PORT or tls://HOST:PORT, as 'dask scheduler' prints it")),
        (["scheduler=dask", "scheduler.address=tcp://a:1", "scheduler.workers=2"], ("scheduler.workers = 2: goes "
         "without scheduler.address only; there, 'dask worker --nworkers N' says how many")),
        (["scheduler=dask", "scheduler.patience_s=0"], "scheduler.patience_s = 0: must be above 0"),
        ([*TLS[:-1], "scheduler.address=tls://a:1", "scheduler.tls_client_key=null"],
         "scheduler.tls_client_key = null: must be given where tls_ca_file is"),
        (["figures.a.type=pie"], f"figures.a.type = pie: must be one of {', '.join(names('figures'))}"),
        (["figures.trajectories.objective=fast"], ("figures.trajectories.objective = fast: must be one of the run's "
         "objectives (settling_time, st_os_u)")),
        (["figures.trajectories.initial_conditions=[ic2]"], ("figures.trajectories.initial_conditions = ic2: must be "
         "one of the run's initial conditions (ic1)")),
    ],
)  # fmt: skip
def test_values_are_refused_in_one_form(words: list[str], sentence: str) -> None:
    assert said(*words) == [sentence]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["survey.axes.alpha_w=0:1:0.1"], "survey.axes.alpha_w = 0:1:0.1: must lie in (0, 1], but holds 0"),
        (["survey.axes.alpha_w=1.3"], "survey.axes.alpha_w = 1.3: must lie in (0, 1]"),
        (["survey.axes.alpha_w=a:b"], ("survey.axes.alpha_w = a:b: must be start:stop:step, a number, or a list of"
         " numbers")),
        (["survey.axes.alpha_v=1"], "unknown key 'survey.axes.alpha_v'; did you mean 'survey.axes.alpha_w'?"),
        (["survey.slice=beta"], "survey.slice = beta: must be null or one of the axes (alpha_w, k_p_w, k_d_w)"),
        (["survey.baseline.k_p=1"], "unknown key 'survey.baseline.k_p'; did you mean 'survey.baseline.k_p_w'?"),
        (["survey.axes.k_p_w=0:2:1e-6", "survey.axes.k_d_w=0:2:1e-3"],
         "survey.axes.k_p_w = 0:2:1e-6: must have at most 1000000 values"),
        (["survey.axes.k_p_w=0:2:1e-4", "survey.axes.k_d_w=0:2:1e-4"],
         "survey.axes: 8400840021 points; at most 100000000"),
    ],
)  # fmt: skip
def test_axes_are_checked_against_the_law(words: list[str], sentence: str) -> None:
    assert said("survey=out_of_plane", *words) == [sentence]


@pytest.mark.parametrize("spec", ["0.91", "[0.91,1.0]", "'0.9:1.0:0.05'", "0.9:1.0:0.05", "1.0:0.9:-0.05"])
def test_forms_of_an_axis(spec: str) -> None:
    assert "alpha_w" in plain("survey=out_of_plane", f"survey.axes.alpha_w={spec}")["survey"]["axes"]


def test_an_initial_condition_that_moves_nothing() -> None:
    assert said("initial_condition=own") == [
        (
            "initial_condition.own: nothing moves, for all states of the plant are 0; set one of w, w_dot "
            "(set by initial_condition=own)"
        )
    ]


def test_keys_are_not_blamed_on_a_plant_that_is_wrong_itself() -> None:
    assert said("plant.type=moon", "controller.alpha_w=0.9") == [
        f"plant.type = moon: must be one of {', '.join(names('plants'))}"
    ]


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
        max_leaves=6,
    ),
    st.sampled_from(sorted(RunConfig.model_fields)),
)
def test_whatever_stands_in_a_field_gets_a_sentence(value: Any, field: str) -> None:
    data = VALID | {field: value}
    try:
        RunConfig.model_validate(data)
    except ValidationError as error:
        sentences = problems(error)
        assert sentences
        assert all(sentence and "Input should" not in sentence for sentence in sentences)


VALID = compose(["experiment=outofplane"]).model_dump(mode="json")
