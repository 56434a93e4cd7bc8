"""The accuracy study: its references, its rows, what it finds, and its figure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fracctl.accuracy import AccuracyEvaluation, References
from fracctl.accuracy.references import matrix_exponential
from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.errors import ConfigurationError, FracctlError
from fracctl.execution.library import run
from fracctl.figures import FigureError
from fracctl.figures.results import Results, select
from fracctl.figures.work_precision import build
from fracctl.loop import ClosedLoop
from fracctl.solvers import Contour
from fracctl.store import RunDirectory
from fracctl.trajectory import Trajectory

QUICK = ["evaluation.members=1", "evaluation.repeats=1"]
FEW = [
    *("survey.axes.alpha_w=[0.8,0.91,1.0]", "evaluation.contour=[1e-5,1e-8]"),
    *("evaluation.volterra=[8,16]", "evaluation.collocation=[32,64,128]", *QUICK),
]


def evaluation_of(*words: str) -> AccuracyEvaluation:
    evaluation, _ = build_checked(compose(["experiment=solver_accuracy", *QUICK, *words]))
    assert isinstance(evaluation, AccuracyEvaluation)
    return evaluation


def rows_of(evaluation: AccuracyEvaluation, alpha: float) -> pd.DataFrame:
    settings = evaluation.axes["setting"]
    design = {"alpha_w": np.full(len(settings), alpha), "k_p_w": np.array([0.85]), "k_d_w": np.array([2.0])}
    return pd.DataFrame(evaluation(design | {"setting": settings}))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    folder = tmp_path_factory.mktemp("accuracy")
    return RunDirectory(run("solver_accuracy", [*FEW, f"output_dir={folder}"]).run_directory)


@pytest.mark.parametrize("alpha", [0.6, 0.91, 1.0])
def test_estimates_bound_the_errors(alpha: float) -> None:
    rows = rows_of(evaluation_of("evaluation.collocation=[16,32,64,128]"), alpha)
    assert set(rows["solver"]) == {"contour", "volterra", "collocation"}
    assert (rows["status"] == "ok").all()
    assert (rows[["error", "control_error"]].max(axis=1) <= rows["error_estimate"] + 2e-12).all()
    contour = rows[rows["solver"] == "contour"]
    assert (contour["error"] <= contour["resolution"]).all()
    assert (rows["seconds_per_trajectory"] > 0.0).all()


@pytest.mark.parametrize(("periods", "measured"), [(6, [5.6e-3, 1.2e-3, 2.7e-4]), (2, [1.7e-3, 3.7e-4, 8.2e-5])])
def test_the_measured_errors_of_the_papers_method(periods: int, measured: list[float]) -> None:
    """α = 0.91, N = 32, 64, 128: the published horizon is six periods; over two the nodes lie closer."""
    words = ["evaluation.contour=[]", "evaluation.volterra=[]", "evaluation.collocation=[32,64,128]"]
    rows = rows_of(evaluation_of(f"horizon_periods={periods}", *words, "initial_condition=ic1"), 0.91)
    assert rows["error"].tolist() == pytest.approx(measured, rel=0.15)


def test_errors_are_not_measured_against_the_solver_itself() -> None:
    evaluation = evaluation_of()
    state = evaluation.initial_conditions["ic1"]
    references = References(evaluation.loop({"alpha_w": 0.91}), state, evaluation.horizon)
    assert references.disagreement < 1e-11
    of_contour = references.independent_of("contour")
    assert of_contour is not references.independent_of("volterra")
    assert references.independent_of("volterra") is references.independent_of("collocation")
    exact = References(evaluation.loop({"alpha_w": 1.0}), state, evaluation.horizon)
    assert exact.independent_of("contour") is exact.independent_of("volterra")


def test_references_that_disagree_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fracctl.accuracy.references.Contour", lambda tolerance: Contour(1e-4))
    evaluation = evaluation_of()
    with pytest.raises(FracctlError, match=r"the reference trajectories disagree by \d.\de-0\d of the peak"):
        References(evaluation.loop({"alpha_w": 0.91}), evaluation.initial_conditions["ic1"], evaluation.horizon)


def test_the_matrix_exponential_in_closed_form() -> None:
    """w'' + 2 w' + 1.85 w = 0."""
    loop = evaluation_of().loop({"alpha_w": 1.0, "k_p_w": 0.85, "k_d_w": 2.0})
    times = np.linspace(0.0, 9.0, 31)
    samples = matrix_exponential(loop.system, np.array([0.0, 0.002]), times)
    assert samples is not None
    omega = np.sqrt(0.85)
    position = 0.002 * np.exp(-times) * np.sin(omega * times) / omega
    rate = 0.002 * np.exp(-times) * np.cos(omega * times) - position
    assert samples.positions[:, 0] == pytest.approx(position, abs=1e-16)
    assert samples.controls[:, 0] == pytest.approx(-0.85 * position - 2.0 * rate, abs=1e-16)
    assert matrix_exponential(evaluation_of().loop({"alpha_w": 0.9}).system, np.array([0.0, 1.0]), times) is None


def test_an_estimate_below_the_error_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluation = evaluation_of("evaluation.contour=[1e-4]", "evaluation.volterra=[]", "evaluation.collocation=[]")
    solve = Contour.solve

    def overconfident(self: Contour, loop: ClosedLoop, state: np.ndarray, horizon: float) -> Trajectory:
        return replace(solve(self, loop, state, horizon), error_estimate=np.zeros(1))

    monkeypatch.setattr(Contour, "solve", overconfident)
    assert set(rows_of(evaluation, 0.91)["status"]) == {"failed"}


def test_a_run_stores_rows_and_findings(finished: RunDirectory) -> None:
    rows = finished.evaluations()
    assert len(rows) == 3 * 7 * 2
    assert rows["solver"].value_counts().to_dict() == {"collocation": 18, "contour": 12, "volterra": 12}
    assert finished.optima().empty
    summary = finished.run_json["summary"]
    assert (summary["status"], summary["optimum"], summary["optima"]) == ("finished", None, [])
    assert "collocation with N = 64: 4.0e-04" in summary["notes"][0]
    assert "off from ic1 by 3.9e-04 at order 0.8, 3.7e-04 at order 0.91" in summary["notes"][1]


def test_the_controller_alone_can_be_studied(tmp_path: Path) -> None:
    words = ["survey=single", "evaluation.contour=[1e-8]", "evaluation.volterra=[]", "evaluation.collocation=[]"]
    result = run("solver_accuracy", [*words, *QUICK, f"output_dir={tmp_path}"])
    assert result.evaluations["alpha_w"].tolist() == [1.0, 1.0]


def test_what_the_figure_shows(finished: RunDirectory) -> None:
    results = Results(finished)
    figure, table = build(results, select(results, {}))
    left, right = figure.axes
    labels = [str(line.get_label()) for line in left.lines]
    assert [label for label in labels if label.startswith("collocation")] == [
        rf"collocation, $\alpha = {order:g}$" for order in (0.8, 0.91, 1.0)
    ]
    (theory,) = [line for line in left.lines if r"s^{3 - \alpha}" in str(line.get_label())]
    slopes = [
        line for line in left.lines if line.get_linestyle() == theory.get_linestyle() and len(line.get_xdata()) == 2
    ]
    rates = [np.diff(np.log(line.get_ydata()))[0] / np.diff(np.log(line.get_xdata()))[0] for line in slopes]
    assert rates == pytest.approx([-2.18, -2.4])
    assert len([line for line in right.lines if len(line.get_xdata())]) == 6
    assert len(table) == 3 * 7 * 2
    assert {path.suffix for path in finished.figures.iterdir()} == {".pdf", ".png", ".csv"}


def test_the_slope_without_an_initial_rate(finished: RunDirectory) -> None:
    results = Results(finished)
    figure, _ = build(results, select(results, {"initial_conditions": ["ic2"]}))
    assert any(r"s^{4 - \alpha}" in str(line.get_label()) for line in figure.axes[0].lines)


def test_other_runs_have_no_such_figure(tmp_path: Path) -> None:
    result = run("ic1_outofplane", ["survey=single", "figures=[work_precision]", f"output_dir={tmp_path}"])
    assert "errors of the solvers need" in " ".join(result.summary["notes"])
    results = Results(RunDirectory(result.run_directory))
    with pytest.raises(FigureError, match="errors of the solvers"):
        build(results, select(results, {}))


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("evaluation.contour=[1e-8,2]", r"evaluation\.contour = .*: must lie in \[1e-11, 1e-3\], but holds 2"),
        ("evaluation.volterra=[128]", r"evaluation\.volterra = .*, but holds 128"),
        ("evaluation.members=0", r"evaluation\.members = 0: must be at least 1"),
        ("evaluation.type=speed", r"evaluation\.type = speed: must be one of performance, accuracy"),
    ],
)
def test_settings_that_no_solver_takes(word: str, sentence: str) -> None:
    with pytest.raises(ConfigurationError, match=sentence):
        compose(["experiment=solver_accuracy", word])
