"""Every YAML file of the repository: it says what it is, and it composes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fracctl.config.build import build_checked
from fracctl.config.catalogue import built_in_directory, catalogue
from fracctl.config.compose import compose
from fracctl.config.yaml_traps import traps
from fracctl.execution.run import execute

CONF = built_in_directory()
FILES = sorted(CONF.rglob("*.yaml"))
EXPERIMENTS = catalogue().options("experiment")
GROUPS = (
    "plant",
    "controller",
    "initial_condition",
    "solver",
    "measures",
    "objectives",
    "evaluation",
    "survey",
    "scheduler",
    "figures",
    "experiment",
)

OF_EXPERIMENTS = {
    "libration": [
        *("plant=libration", "controller=delayed_feedback", "initial_condition=tumbling", "solver=method_of_steps"),
        *("evaluation=delayed", "measures=libration", "objectives=periodicity"),
        *("survey=gains_delayed", "survey=controlled_or_free", "survey=free_motion"),
    ],
    "ellipsoid": [
        *("plant=rotating_ellipsoid", "controller=eros_wide", "controller=eros_near", "measures=orbit"),
        "controller=windowed_regulator",
        *(f"initial_condition={name}" for name in catalogue().options("initial_condition") if name.startswith("rho_")),
    ],
    "libration_adaptive": ["controller=adaptive_delay", "survey=adapted_or_not", "measures=adaptive"],
    "ellipsoid_free": ["measures=free_orbit", "objectives=distance"],
    "formation": [
        *("plant=relative_motion", "controller=delayed_lqr", "measures=formation", "objectives=drift"),
        *("survey=weights_delayed", "measures=formation_perturbed", "plant=perturbed_relative_motion"),
        *(f"initial_condition={name}" for name in catalogue().options("initial_condition") if "formation" in name),
    ],
    "tether": [
        *("controller=fda_smc", "controller=da_smc", "controller=fo_smc_reconstruction", "solver=implicit_memory"),
        *("evaluation=memory", "evaluation=tether_laws", "measures=tether", "objectives=deployment"),
        *("initial_condition=release", "initial_condition=release_fast", "initial_condition=release_slow"),
        *("initial_condition=deployed", "initial_condition=deployed_swinging"),
    ],
    "flight_ic1": [
        *("evaluation=flight", "evaluation=flight_dispersed", "evaluation=flight_laws_ic1", "measures=flown"),
        *("objectives=flown", "figures=survival", "initial_condition=ic1_distances"),
    ],
    "flight_ic2": ["evaluation=flight_laws_ic2", "initial_condition=ic2_distances"],
    "flight_ic3": ["evaluation=flight_laws_ic3", "initial_condition=ic3_distances"],
    "flight_design": ["evaluation=robust", "measures=design"],
    "tether_eccentric": ["plant=tether_eccentric", "evaluation=tether_laws_eccentric"],
    "tether_orders": ["survey=tether_orders"],
    "tether_retrieval": ["survey=tether_approaches"],
}
"""Options of delayed feedback, tethers and flights, by an experiment that has all else they need."""

SLIDING_MODES = ("fda_smc", "da_smc", "fo_smc_reconstruction")
COMPANIONS = {
    "plant=hcw": ["controller=pd_alpha_full"],
    "plant=hcw_in_plane": ["controller=pd_alpha_in_plane"],
    "plant=linear": ["controller=pd_alpha_own", "initial_condition=own", "initial_condition.own.x=1"],
    "controller=pd_in_plane": ["plant=hcw_in_plane"],
    "controller=pd_alpha_in_plane": ["plant=hcw_in_plane"],
    "plant=tether": ["experiment=libration", "initial_condition=own", "initial_condition.own.length=1"],
    "initial_condition=release_eccentric": ["experiment=tether_eccentric"],
    "controller=pd_alpha_full": ["plant=hcw"],
    "controller=pd_alpha_published_full": ["plant=hcw"],
    "figures=approach": ["plant=hcw", "controller=pd_alpha_full"],
    "plant=tschauner_hempel": ["experiment=nonlinear_ic1"],
    "controller=pd_alpha_relative": ["experiment=nonlinear_ic1"],
    "initial_condition=ic1_relative": ["experiment=nonlinear_ic1"],
    "controller=pd_lag_in_plane": ["plant=hcw_in_plane"],
    "controller=pid_in_plane": ["plant=hcw_in_plane"],
    "controller=pdd_alpha_in_plane": ["plant=hcw_in_plane"],
    "controller=pi_lambda_d_mu_in_plane": ["plant=hcw_in_plane"],
    "controller=published_in_plane": ["plant=hcw_in_plane"],
    "initial_condition=radial": ["plant=hcw_in_plane", "controller=pdd_alpha_in_plane"],
    "initial_condition=own": ["initial_condition.own.w=1e-3"],
    "objectives=in_plane": ["objective=st_os"],
    "survey=in_plane": ["plant=hcw_in_plane", "controller=pd_alpha_in_plane"],
    "survey=published_in_plane": ["plant=hcw_in_plane", "controller=pd_alpha_in_plane"],
    "figures=paper_6_to_9": ["initial_condition=[ic1,ic2,ic3]", "objectives=in_plane", "objective=st_os"],
    "evaluation=comparison": ["survey=comparison"],
    "evaluation=comparison_in_plane": ["plant=hcw_in_plane", "controller=pd_in_plane", "survey=comparison"],
    "survey=comparison": ["evaluation=comparison"],
    **{option: [f"experiment={name}"] for name, options in OF_EXPERIMENTS.items() for option in options},
    **{f"controller={law}": ["experiment=tether", "evaluation=memory"] for law in SLIDING_MODES},
    "figures=tether_spread": ["experiment=tether_monte_carlo"],
    "figures=paper_2_to_5": ["initial_condition=[ic1,ic2,ic3]", "survey=out_of_plane"],
}
"""What an option needs beside it."""

OPTIONS = [f"{group}={option}" for group in catalogue().groups() for option in catalogue().options(group)]

TINY = [
    "survey.axes.alpha_w=[0.9,1.0]",
    "survey.axes.k_p_w=[0.6,1.0]",
    "survey.axes.k_d_w=[1.5,2.0]",
    "scheduler=serial",
]
TINY_SETTINGS = {
    "solver_accuracy": [f"evaluation.{words}" for words in ("contour=[1e-8]", "volterra=[16]", "collocation=[16]")]
    + ["evaluation.members=2", "evaluation.repeats=1"]
}
"""What else an experiment needs for a tiny budget."""
CONTINUATIONS = ("ic1_inplane", "ic2_inplane", "ic3_inplane", "inplane")
TINY_CONTINUATION = [
    "survey.axes.alpha_u=[0.99,1.0]",
    "survey.axes.alpha_v=[0.99,1.0]",
    "survey.first_steps=[0.5]",
    "survey.steps=[0.5]",
    "scheduler=serial",
]
COMPARISONS = ("fair_inplane", "fair_outofplane")
"""Experiments with tests of their own, in tests/comparison."""
SEARCHES = ("ic1_inplane_search", "ic1_inplane_pareto")
TINY_SEARCH = [
    "survey.bounds.gains=[0,4]",
    "survey.population=50",
    "survey.evaluations=100",
    "survey.starts=1",
    "scheduler=serial",
]
DELAYED = {
    "libration": 2,
    "libration_onset": 1,
    "libration_window": 4,
    "libration_adaptive": 2,
    "ellipsoid": 2,
    "ellipsoid_free": 1,
    "ellipsoid_near": 2,
    "ellipsoid_regulator": 2,
    "ellipsoid_starts": 2,
    "formation": 2,
    "formation_eccentric": 2,
    "formation_perturbed": 2,
    "formation_weights": 2,
}
"""Experiments under delayed feedback, with their number of points on a tiny budget."""
TINY_DELAYED = {
    "libration_window": ["survey.axes.gain_1_2=[0.2,0.3]", "survey.axes.recall=[0.0,0.3]"],
    "formation_weights": ["survey.axes.beta=[100.0,1000.0]"],
}
TETHERS = {
    "tether": ([], 3),
    "tether_causes": ([], 6),
    "tether_eccentric": ([], 3),
    "tether_monte_carlo": (["evaluation.samples=3"], 6),
    "tether_orders": (["survey.axes.alpha_1=[0.0,0.5]", "survey.axes.nu=[0.4,0.5]"], 4),
    "tether_release": ([], 3),
    "tether_retrieval": (["survey.axes.reference_rate=[0.0,0.7]"], 2),
    "tether_station_keeping": ([], 3),
}
"""Experiments with a memory in the loop: what makes them tiny, and their rows for each start."""
FIXED = {
    "elliptic_ic1": 1,
    "ic1_bands": 4,
    "ic1_flight_plots": 1,
    "inplane_decoupled": 1,
    "inplane_lqr": 1,
    "inplane_published": 2,
    "nonlinear_ic1": 1,
    "perturbed_ic1": 1,
}
"""Experiments of so few design points that they need no budget, with their number."""


FLIGHTS = ("flight_ic1", "flight_ic2", "flight_ic3", "flight_leo")
TINY_FLIGHT = ["horizon_periods=1", "evaluation.samples=2", "evaluation.noise_samples=1", "evaluation.period_s=60"]
DESIGNS = ("flight_design", "flight_design_inplane")
TINY_DESIGN = [
    "survey.evaluations=480",
    "survey.starts=1",
    "evaluation.samples=4",
    "survey.bounds.gains=[-4,4]",
    "~constraints.peak_acceleration_mm_s2",
]


def test_the_groups() -> None:
    assert set(catalogue().groups()) == set(GROUPS)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(CONF)))
def test_a_file_starts_with_what_it_is(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("# ")
    assert traps(path) == []
    if path.parent.name == "experiment":
        assert lines[0] == f"# fracctl run experiment={path.stem}"
        assert lines[1].startswith("# ")


LONG = {
    *("inplane", "ic2_inplane", "ic3_inplane", "flight_ic2", "flight_ic3", "flight_leo"),
    *("ellipsoid", "ellipsoid_free", "ellipsoid_near", "ellipsoid_starts", "formation", "formation_perturbed"),
    *("tether_causes", "tether_eccentric", "tether_retrieval", "tether_station_keeping"),
}
"""Experiments like others that take less, whose runs are left to the slow tests."""


def marked(names: Iterable[str]) -> list[Any]:
    return [pytest.param(name, marks=pytest.mark.slow) if name in LONG else name for name in names]


@pytest.mark.parametrize("word", OPTIONS)
def test_an_option_composes(word: str) -> None:
    build_checked(compose([word, *COMPANIONS.get(word, [])]))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_an_experiment_bears_its_name(name: str) -> None:
    assert compose([f"experiment={name}"]).name == name


@pytest.mark.parametrize("name", marked(CONTINUATIONS))
def test_a_continuation_runs_on_a_tiny_budget(name: str, tmp_path: Path) -> None:
    config = compose([f"experiment={name}", *TINY_CONTINUATION, f"output_dir={tmp_path}"])
    result = execute(config)
    tracks = len(config.objectives) * len(config.initial_condition)
    assert result.summary["status"] == "finished"
    assert result.evaluations["point"].nunique() == 5 * tracks
    assert result.optima.groupby("kind").size().to_dict() == {
        "overall": tracks,
        "baseline": tracks,
        "slice": 4 * tracks,
    }
    assert {path.stem for path in (result.run_directory / "figures").glob("*.pdf")} == set(config.figures)


@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_runs_on_a_tiny_budget(name: str, tmp_path: Path) -> None:
    config = compose([f"experiment={name}", *TINY_SEARCH, f"output_dir={tmp_path}"])
    result = execute(config)
    assert result.summary["status"] == "finished"
    assert result.summary["optimum"]["objective"] <= result.summary["baseline"]["objective"]
    assert {path.stem for path in (result.run_directory / "figures").glob("*.pdf")} == set(config.figures)


@pytest.mark.parametrize("name", marked(FLIGHTS))
def test_flights_run_on_a_tiny_budget(name: str, tmp_path: Path) -> None:
    config = compose([f"experiment={name}", *TINY_FLIGHT, "scheduler=serial", f"output_dir={tmp_path}"])
    result = execute(config)
    assert result.summary["status"] == "finished"
    assert set(result.evaluations["status"]) <= {"ok", "unsettled"}
    assert len(result.summary["tables"]["survival"]) == 6 * 5 * len(config.initial_condition), "laws, stages and starts"
    assert {path.stem for path in (result.run_directory / "figures").glob("*.pdf")} == set(config.figures)


@pytest.mark.parametrize("name", DESIGNS)
def test_a_design_for_flights_runs_on_a_tiny_budget(name: str, tmp_path: Path) -> None:
    config = compose([f"experiment={name}", *TINY_DESIGN, "scheduler=serial", f"output_dir={tmp_path}"])
    result = execute(config)
    assert result.summary["status"] == "finished"
    assert {path.stem for path in (result.run_directory / "figures").glob("*.pdf")} == set(config.figures)


@pytest.mark.parametrize("name", marked(DELAYED))
def test_an_experiment_under_delayed_feedback_runs_on_a_tiny_budget(name: str, tmp_path: Path) -> None:
    budget = ["horizon_periods=3", "solver.steps=40", *TINY_DELAYED.get(name, [])]
    if name in ("libration", "libration_onset", "libration_window"):
        budget += ["measures.lyapunov_exponent.periods=2", "measures.lyapunov_exponent.transient_periods=0"]
    config = compose([f"experiment={name}", *budget, f"output_dir={tmp_path}"])
    result = execute(config)
    assert result.summary["status"] == "finished"
    assert len(result.evaluations) == DELAYED[name] * len(config.initial_condition)
    assert np.isfinite(result.evaluations["error_estimate"]).all()
    assert {path.stem for path in (result.run_directory / "figures").glob("*.pdf")} == set(config.figures)


@pytest.mark.parametrize("name", marked(TETHERS))
def test_an_experiment_with_a_memory_runs_on_a_tiny_budget(name: str, tmp_path: Path) -> None:
    budget, rows = TETHERS[name]
    fixed = ["horizon_periods=1", "solver.step=0.02", "scheduler=serial", f"output_dir={tmp_path}"]
    config = compose([f"experiment={name}", *budget, *fixed])
    result = execute(config)
    assert result.summary["status"] == "finished"
    assert len(result.evaluations) == rows * len(config.initial_condition)
    assert np.isfinite(result.evaluations["error_estimate"]).all()
    assert {path.stem for path in (result.run_directory / "figures").glob("*.pdf")} == set(config.figures)


OTHERS = {*CONTINUATIONS, *SEARCHES, *COMPARISONS, *DELAYED, *TETHERS, *FLIGHTS, *DESIGNS}


@pytest.mark.parametrize("name", sorted({*EXPERIMENTS} - OTHERS))
def test_an_experiment_runs_on_a_tiny_budget(name: str, tmp_path: Path) -> None:
    budget = [] if name in FIXED else [*TINY, *TINY_SETTINGS.get(name, [])]
    config = compose([f"experiment={name}", *budget, f"output_dir={tmp_path}"])
    result = execute(config)
    settings = max(1, len(build_checked(config)[0].axes.get("setting", ())))
    assert result.summary["status"] == "finished"
    assert len(result.evaluations) == FIXED.get(name, 8) * settings * len(config.initial_condition)
    assert {path.stem for path in (result.run_directory / "figures").glob("*.pdf")} == set(config.figures)


def test_the_papers_orders() -> None:
    evaluation, survey = build_checked(compose(["experiment=inplane"]))
    assert survey.slices == ("alpha_u", "alpha_v")
    assert survey.n_points == 3 * 2 * (1 + 20 + 2 * 100), "a search from every neighbour"
    assert dict(evaluation.objectives) == {
        "st_os": ("settling_time", "overshoot"),
        "st_u": ("settling_time", "control_effort"),
    }


def test_the_papers_grid() -> None:
    config = compose(["experiment=outofplane"])
    evaluation, survey = build_checked(config)
    assert survey.n_points == 21 * 41 * 41
    assert list(evaluation.initial_conditions) == ["ic1", "ic2", "ic3"]
