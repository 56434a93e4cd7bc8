"""The stored frequency responses of optima: L by its formula, and its plot among the files of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import fracctl as fc
from fracctl.config.compose import compose
from fracctl.controllers import PDLag
from fracctl.execution.run import execute
from fracctl.store import RunDirectory

SMALL = ["survey.axes.alpha_w=[0.91,1.0]", "survey.axes.k_p_w=[0.55,0.85]", "survey.axes.k_d_w=1.5:2:0.1"]


def test_a_run_stores_the_loop_gains_of_its_optima(tmp_path: Path) -> None:
    result = fc.run("ic1_margins", [*SMALL, f"output_dir={tmp_path}"])
    table = RunDirectory(result.run_directory).frequency_response()
    shown = result.optima[result.optima["kind"] != "slice"]
    assert set(table["run"]) == set(shown.index)
    for run, row in shown.iterrows():
        part = table[table["run"] == run]
        omega = part["frequency"].to_numpy()
        loop = (row["k_p_w"] + row["k_d_w"] * (1j * omega) ** row["alpha_w"]) / (1.0 - omega**2)
        np.testing.assert_allclose(part["loop_real"] + 1j * part["loop_imag"], loop, rtol=1e-9)
        np.testing.assert_allclose(part["sensitivity"], 1.0 / np.abs(1.0 + loop), rtol=1e-9)
        np.testing.assert_allclose(part["complementary"], np.abs(loop / (1.0 + loop)), rtol=1e-9)
        assert part["sensitivity"].max() == pytest.approx(row["sensitivity_peak"], abs=1e-3)
    best, baseline = result.summary["optimum"], result.summary["baseline"]
    assert [best["phase_margin_deg"], baseline["phase_margin_deg"]] == pytest.approx([71.28, 83.53], abs=0.01)
    assert best["gain_margin_db"] is None, "infinite"
    names = {path.name for path in (result.run_directory / "figures").iterdir()}
    assert {"bode.pdf", "nyquist.pdf"} <= names


def test_two_controls(tmp_path: Path) -> None:
    """det(I + L) - 1, whose logarithm is that of the characteristic functions of the closed and the open loop."""
    words = ["plant=hcw_in_plane", "controller=pd_lag_in_plane", "measures=in_plane", "figures=nyquist"]
    result = execute(compose([*words, f"output_dir={tmp_path}"]))
    table = RunDirectory(result.run_directory).frequency_response()
    row = result.optima.iloc[0]
    s = 1j * table["frequency"].to_numpy()[:, None, None]
    law = PDLag.from_parameters(("u", "v"), {name: row[name] for name in row.index if name.startswith(("k_", "time_"))})
    plant = s**2 * np.eye(2) - s * np.array([[0.0, 2.0], [-2.0, 0.0]]) - np.diag([3.0, 0.0])
    control = law.k_p + law.k_d * s / (law.time_constant * s + 1.0)
    expected = np.linalg.det(np.eye(2) + control @ np.linalg.inv(plant)) - 1.0
    np.testing.assert_allclose(table["loop_real"] + 1j * table["loop_imag"], expected, rtol=1e-6)
