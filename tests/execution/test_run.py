"""Runs of the real configuration, from `fracctl.run` to the numbers in spec and paper."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fracctl
from fracctl.config.compose import compose
from fracctl.errors import ArgumentError, RunError
from fracctl.execution.run import RunResult, execute
from fracctl.store import RunDirectory
from tests.execution.test_perform import tables_of
from tests.store.disks import full_after

ROOT = Path(__file__).parents[2]
TWO_ORDERS = ["survey.axes.alpha_w=[0.91,1.0]", "figures=[]"]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    folder = tmp_path_factory.mktemp("result")
    return fracctl.run("ic1_outofplane", [*TWO_ORDERS, f"output_dir={folder}"])


def test_the_paper_s_main_result_from_python(result: RunResult) -> None:
    optimum, baseline = result.summary["optimum"], result.summary["baseline"]
    assert (optimum["alpha_w"], optimum["k_p_w"], optimum["k_d_w"]) == (0.91, 0.85, 2.0)
    assert optimum["settling_time"] == pytest.approx(3.01276, abs=5e-6)
    assert (baseline["alpha_w"], baseline["k_p_w"], baseline["k_d_w"]) == (1.0, 0.55, 2.0)
    assert baseline["settling_time"] == pytest.approx(3.96958, abs=5e-6)
    tail, *taught, check = result.summary["notes"]
    assert any("k_d_w = 2 is the upper end of survey.axes.k_d_w" in note for note in taught)
    assert tail == "ic1, settling_time: settles to 100 m after 0.479 orbits, but to 10 m only after 2.15"
    assert check.startswith("cross-check:")
    assert len(result.evaluations) == 2 * 41 * 41
    assert set(result.optima["kind"]) == {"slice", "overall", "baseline"}
    assert RunDirectory(result.run_directory).run_json["provenance"]["workers"] == 1
    assert RunDirectory(result.run_directory).verify() == []


def test_tables_are_bitwise_equal_for_any_scheduler(tmp_path: Path) -> None:
    axes = ["survey.axes.alpha_w=0.90:1.00:0.05", "survey.axes.k_p_w=0:2:0.1", "survey.axes.k_d_w=0:2:0.1"]
    schedulers = [["scheduler=serial"], ["scheduler=local", "scheduler.workers=1"], ["scheduler=local"]]
    tables = []
    for number, scheduler in enumerate(schedulers):
        words = ["experiment=outofplane", "figures=[]", f"output_dir={tmp_path / str(number)}", *axes, *scheduler]
        tables.append(tables_of(execute(compose(words, None)).run_directory))
    assert tables[0] == tables[1]
    assert tables[0] == tables[2]


@pytest.mark.slow
def test_tables_are_bitwise_equal_whether_kernels_are_compiled_or_loaded(tmp_path: Path) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    axes = ["survey.axes.alpha_w=0.95", "survey.axes.k_p_w=0:2:0.25", "survey.axes.k_d_w=0:2:0.25"]
    tables = []
    for name in ("compiled", "loaded"):
        words = ["experiment=outofplane", "figures=[]", f"output_dir={tmp_path / name}", *axes, "scheduler=serial"]
        command = [sys.executable, "-m", "fracctl", "run", "--quiet", *words]
        done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True)
        tables.append(tables_of(Path(done.stdout.splitlines()[-1])))
    assert len(tables[0]["evaluations"]["status"]) == 3 * 81
    assert tables[0] == tables[1]


def test_overrides_may_choose_the_scheduler(tmp_path: Path) -> None:
    axes = ["survey.axes.alpha_w=1.0", "survey.axes.k_p_w=[0.5,1.0]", "survey.axes.k_d_w=[1.0,2.0]"]
    words = [*axes, "figures=[]", f"output_dir={tmp_path}", "scheduler=local", "scheduler.workers=2"]
    run = RunDirectory(fracctl.run("ic1_outofplane", words).run_directory)
    assert run.run_json["configuration"]["scheduler"] == {"type": "local", "workers": 2, "time_limit": None}


def test_one_text_is_no_list_of_overrides() -> None:
    with pytest.raises(ArgumentError, match=r"`overrides` must be a list of words, but is .*; write \['seed=1'\]"):
        fracctl.run("ic1_outofplane", "seed=1")


def test_trajectories_are_those_of_the_optima(result: RunResult) -> None:
    trajectories = RunDirectory(result.run_directory).trajectories()
    assert list(trajectories) == ["run", "time", "w", "w_dot", "control_w"]
    loop = fracctl.ClosedLoop(
        fracctl.plants.HCWOutOfPlane(), fracctl.controllers.PDAlpha(k_p=0.85, k_d=2.0, alpha=0.91)
    )
    expected = fracctl.solve(loop, initial_state=[0.0, 0.002], horizon=12 * np.pi)
    row = result.optima.query("kind == 'overall' and objective_name == 'settling_time'").index[0]
    found = trajectories[trajectories["run"] == row]
    times = found["time"].to_numpy()
    assert times[[0, -1]] == pytest.approx([0.0, 12 * np.pi])
    np.testing.assert_allclose(found[["w", "w_dot"]].to_numpy(), expected(times), atol=1e-11)
    np.testing.assert_allclose(found[["control_w"]].to_numpy(), expected.control(times), atol=1e-11)


def test_a_control_effort_without_limit_is_told(tmp_path: Path) -> None:
    """Spec 1, section 2: U = 1.45475e-3 and 1.48295e-3 at 8π and 16π for this point, so 1.9 % more."""
    words = ["initial_condition=ic2", "objective=st_os_u", "controller.alpha_w=0.97", "controller.k_p_w=0.75"]
    words += ["controller.k_d_w=1.95", "horizon_periods=4", "figures=[]", f"output_dir={tmp_path}"]
    notes = execute(compose(words, None)).summary["notes"]
    assert any("grows by 2.8e-05 (1.9 %) from 4 to 8 orbits" in note for note in notes)


def test_a_point_that_does_not_settle_says_so(tmp_path: Path) -> None:
    words = ["controller.k_p_w=0.0", "controller.k_d_w=0.0", f"output_dir={tmp_path}"]
    summary = execute(compose(words, None)).summary
    assert summary["optimum"] is None
    assert summary["status"] == "finished"
    assert any("no optimum of settling_time for ic1 (points: 1 unsettled)" in note for note in summary["notes"])


def test_other_figures_are_drawn_without_computing(tmp_path: Path) -> None:
    words = ["controller.k_p_w=0.85", "controller.k_d_w=2.0", f"output_dir={tmp_path}"]
    first = execute(compose([*words, "figures=[]"], None))
    assert not (first.run_directory / "figures").exists()
    second = execute(compose([*words, "figures=[trajectories]"], None))
    assert second.reused
    run = RunDirectory(second.run_directory)
    assert {path.suffix for path in run.figures.iterdir()} == {".pdf", ".png", ".csv"}
    assert run.verify() == []
    assert list(run.run_json["configuration"]["figures"]) != []
    assert execute(compose([*words, "figures=[]"], None)).reused
    assert not run.figures.exists()
    assert run.verify() == []


def test_figures_that_cannot_be_drawn_are_told_every_time(tmp_path: Path) -> None:
    words = ["controller.k_p_w=0.85", "controller.k_d_w=2.0", f"output_dir={tmp_path}"]
    execute(compose([*words, "figures=[]"], None))
    asked = [execute(compose([*words, "figures=[pareto_fronts]"], None)) for _ in range(2)]
    for result in asked:
        (undrawn,) = result.summary["undrawn_figures"]
        assert undrawn.startswith("figure 'pareto_fronts': ")
        assert result.summary["notes"].count(undrawn) == 1
    drawn = execute(compose([*words, "figures=[trajectories]"], None)).summary
    assert drawn["undrawn_figures"] == []
    assert undrawn not in drawn["notes"]


def test_a_full_disk_leaves_the_figures_there_are_and_drawing_is_tried_again(tmp_path: Path) -> None:
    words = ["controller.k_p_w=0.85", "controller.k_d_w=2.0", f"output_dir={tmp_path}"]
    run = RunDirectory(execute(compose([*words, "figures=[trajectories]"], None)).run_directory)
    before = {path.name: path.read_bytes() for path in run.figures.iterdir()}
    with full_after(100), pytest.raises(RunError, match="No space left on device"):
        execute(compose([*words, "figures=[trajectories,poles]"], None))
    assert {path.name: path.read_bytes() for path in run.figures.iterdir()} == before
    assert run.verify() == []
    assert execute(compose([*words, "figures=[trajectories,poles]"], None)).reused
    assert {path.stem for path in run.figures.iterdir()} == {"trajectories", "poles"}
    assert not run.new_figures.exists()
    assert run.verify() == []


def test_the_package_loads_no_numerical_library() -> None:
    program = "import sys, fracctl; fracctl.__version__; print({'numpy', 'scipy', 'pandas'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("set()\n", "")


def test_the_package_names_what_it_offers() -> None:
    assert set(fracctl.__all__) <= set(dir(fracctl))
    for name in fracctl.__all__:
        assert getattr(fracctl, name)
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        fracctl.nonsense  # noqa: B018
