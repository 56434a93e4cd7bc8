"""Runs under delayed feedback from configuration: rows, delays, baselines, verdicts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fracctl
from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.delayed_evaluation import AT_ONCE, DelayedEvaluation
from fracctl.errors import FracctlError
from fracctl.plants import RotatingEllipsoid
from fracctl.store import RunDirectory

SHORT = ["measures.lyapunov_exponent.periods=2", "measures.lyapunov_exponent.transient_periods=0"]


def evaluation(words: list[str]) -> DelayedEvaluation:
    found = build_checked(compose(words))[0]
    assert isinstance(found, DelayedEvaluation)
    return found


def test_every_start_has_its_own_delay() -> None:
    about_eros = evaluation(["experiment=ellipsoid", "horizon_periods=2"])
    rows = about_eros({"gain_factor": np.array([0.0, 1.0])})
    expected = {"rho_1_75": 2.59471, "rho_1_9": 3.10656, "rho_2_1": 3.83577, "rho_2_2": 4.05965, "rho_2_3": 4.21213}
    assert rows["initial_condition"].tolist() == [name for name in expected for _ in range(2)]
    np.testing.assert_allclose(rows["delay"], np.repeat(list(expected.values()), 2), atol=6e-6)


def test_rows_do_not_depend_on_how_many_are_solved_together() -> None:
    target = "measures.largest_multiplier.guess=[-0.28,-1.08]"
    tumbling = evaluation(["experiment=libration", *SHORT, target, "horizon_periods=3"])
    gains = np.linspace(0.0, 0.6, AT_ONCE + 3)
    rows = tumbling({"gain_1_2": gains})
    alone = tumbling({"gain_1_2": gains[-1:]})
    assert len(rows["status"]) == AT_ONCE + 3
    np.testing.assert_allclose(rows["periodicity_error"][-1], alone["periodicity_error"][0], rtol=1e-11)


def test_a_row_is_the_run_of_the_library() -> None:
    tumbling = evaluation(["experiment=libration", *SHORT, "horizon_periods=4"])
    found = tumbling.solve({"gain_1_2": 0.3, "recall": 0.2}, "tumbling")
    law = fracctl.controllers.DelayedFeedback([[0.0, 0.3]], 2.0 * np.pi, recall=0.2)
    loop = fracctl.ClosedLoop(fracctl.plants.Libration(), law)
    expected = fracctl.solve(loop, [0.0, 1.0], 8.0 * np.pi, "method_of_steps")
    times = np.linspace(0.0, 8.0 * np.pi, 50)
    np.testing.assert_array_equal(found(times), expected(times))
    samples = tumbling.sampled(found, times)
    late = times >= 2.0 * np.pi
    error = np.linalg.norm(expected(times[late]) - expected(times[late] - 2.0 * np.pi), axis=1)
    np.testing.assert_allclose(samples["periodicity_error"][late], error, atol=1e-14)
    assert np.isnan(samples["periodicity_error"][~late]).all()


def test_stored_errors_are_those_of_the_delay_that_holds() -> None:
    words = ["experiment=libration_adaptive", "controller.adapt_from_delays=8", "horizon_periods=12", "solver.steps=40"]
    adaptive = evaluation([*words, "initial_condition.tumbling.phi=-0.28", "initial_condition.tumbling.phi_dot=-1.08"])
    found = adaptive.solve({}, "tumbling")
    times = np.linspace(0.0, found.end[0], 500)
    samples = adaptive.sampled(found, times)
    controlled = times > 2.1 * 2.0 * np.pi
    pull = np.abs(samples["control_phi"][controlled]) / 0.3
    assert (samples["periodicity_error"][controlled] >= pull * (1.0 - 1e-6)).all(), (
        "u = -k (s - s_τ), a part of the error"
    )
    delays = found.delay(times)
    last = samples["periodicity_error"][(delays == delays[-1]) & (times > times[-1] - delays[-1])]
    peak = fracctl.measures.periodicity_error(found)
    assert 0.5 * peak < last.max() <= peak * 1.01


def test_stable_is_the_verdict_of_the_multipliers() -> None:
    words = ["experiment=libration_window", *SHORT, "horizon_periods=2"]
    rows = evaluation(words)({"gain_1_2": np.array([0.17, 0.20, 0.45, 0.48]), "recall": np.zeros(4)})
    assert rows["stable"].tolist() == [False, True, True, False], "the window is 0.184 to 0.461"
    assert rows["free_multipliers_above_one"].tolist() == [0.0] * 4, "the target is a flip saddle, -3.366 and -0.213"
    with_recall = evaluation(words)({"gain_1_2": np.array([0.235, 0.245]), "recall": np.full(2, 0.3)})
    assert with_recall["stable"].tolist() == [False, True], "0.2395 for R = 0.3"


def test_a_limit_of_the_thrust_is_kept() -> None:
    words = ["experiment=ellipsoid", "initial_condition=[rho_2_2]", "horizon_periods=3", "solver.steps=200"]
    times = np.linspace(0.0, 6.0 * np.pi, 2000)
    free, limited = (evaluation([*words, f"evaluation.largest_control={limit}"]) for limit in (10.0, 0.01))
    peaks = [np.linalg.norm(e.solve({}, "rho_2_2").control(times), axis=1).max() for e in (free, limited)]
    assert peaks[0] > 0.05
    assert peaks[1] == pytest.approx(0.01)


def test_the_target_of_a_delay_that_adapts_has_the_last_one() -> None:
    words = ["experiment=libration_adaptive", "measures.largest_multiplier={}", "horizon_periods=140"]
    rows = evaluation(words)({"adaptation_rate": np.array([0.5])})
    assert rows["final_delay"][0] == pytest.approx(2.0 * np.pi, abs=1e-6)
    held = evaluation(["experiment=libration_window", *SHORT, "horizon_periods=2"])({"gain_1_2": np.array([0.3])})
    assert rows["largest_multiplier"][0] == pytest.approx(held["largest_multiplier"][0], abs=1e-5)


def test_no_target_no_verdict() -> None:
    rows = evaluation(["experiment=libration", *SHORT, "horizon_periods=2"])({"gain_1_2": np.array([0.0])})
    assert rows["stable"].tolist() == [None]
    assert np.isnan(rows["largest_multiplier"]).all()


@pytest.mark.parametrize(("beta", "largest"), [(1e2, 0.792), (1e3, 0.445), (1e4, 0.616)])
def test_multipliers_of_a_formation_against_the_weight(beta: float, largest: float) -> None:
    rows = evaluation(["experiment=formation_weights", "horizon_periods=30"])({"beta": np.array([beta])})
    assert rows["largest_multiplier"][0] == pytest.approx(largest, abs=6e-4)
    assert rows["stable"].tolist() == [True]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["experiment=libration", "solver=contour"], "evaluation=delayed and solver=method_of_steps go together"),
        (["solver=method_of_steps"], "go together"),
        (
            ["experiment=ellipsoid", "evaluation.delay_from=period"],
            "has no period of its own; take first_return or given",
        ),
        (
            ["experiment=libration", "evaluation.delay_from=first_return"],
            "has no section of its own; take period or given",
        ),
        (["experiment=libration", "survey.axes.delay=[6.0,6.3]"], "survey.axes.delay: plays no part with"),
        (["experiment=libration", "controller.delay=6.2"], "controller.delay = 6.2: plays no part with"),
        (["experiment=libration_adaptive", "evaluation.delay_from=period"], "set evaluation.delay_from=given"),
        (
            ["experiment=libration_adaptive", "controller.recall=0.3"],
            "controller.recall = 0.3: must be 0 where the delay",
        ),
        (["experiment=libration", "measures.largest_multiplier.guess=[1]"], "must hold 2 numbers, for phi, phi_dot"),
        (["experiment=libration", "measures.overshoot={}"], "of linear fractional loops, not of the method of steps"),
        (["measures.periodicity_error={}"], "of the method of steps, not of linear fractional loops"),
        (["experiment=libration", "survey=lqr_seed"], "lqr takes linear plants, but Libration is none"),
        (["experiment=libration", "controller.recall=1.0"], "must lie in [0, 1)"),
        (["experiment=libration", "controller.delay=0"], "must lie in (0, inf)"),
        (["experiment=libration", "controller.gain_2_1=1"], "gain_2_1"),
        (["experiment=libration", "evaluation.delay_from=always"], "delay_from"),
        (
            ["experiment=libration", "measures.drift_per_orbit={}"],
            "unit = km: needs a plant with units; take dimensionless",
        ),
    ],
)
def test_what_cannot_be_run_gets_a_sentence(words: list[str], sentence: str) -> None:
    with pytest.raises(FracctlError) as problem:
        build_checked(compose(words))
    assert sentence in str(problem.value)


def test_a_survey_of_gains_says_where_multipliers_are_below_one() -> None:
    window = evaluation(["experiment=libration_window", "horizon_periods=2"])
    gains = np.arange(0.14, 0.5, 0.02)
    rows = window(window.parameters | {"gain_1_2": gains, "recall": np.zeros(gains.size)})
    (note,) = window.conclude([rows]).notes
    assert note == "largest multiplier below 1 for gain_1_2 from 0.186 to 0.46 (tumbling; linear between points)"
    assert not window.conclude([{name: column[:1] for name, column in rows.items()}]).notes


def test_free_motion_is_the_baseline_even_where_it_does_not_stay(tmp_path: Path) -> None:
    words = ["initial_condition=[rho_2_3]", "horizon_periods=3", "figures=[]", f"output_dir={tmp_path}"]
    result = fracctl.run("ellipsoid", words)
    kinds = result.optima.set_index("kind")
    assert kinds.loc["baseline", "status"] == "escaped"
    assert kinds.loc["overall", "status"] == "ok"
    radius = RotatingEllipsoid().escape_radius
    trajectories = RunDirectory(result.run_directory).trajectories()
    free = trajectories[trajectories["run"] == result.optima.query("kind == 'baseline'").index[0]]
    assert np.nanmax(np.hypot(free["x"], free["y"])) == pytest.approx(radius, abs=0.05)
    assert free["x"].isna().any(), "nothing behind the end of the run"
