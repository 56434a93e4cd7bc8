"""A survey of a million points streams: its parent needs no more memory for ten times the points."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.processes import run

USAGE = Path(__file__).parents[2] / "benchmarks" / "usage.py"
GAINS = ["survey.axes.k_p_w='0.01:2.24:0.01'", "survey.axes.k_d_w='0.01:2.24:0.01'"]
FEW, MANY = "survey.axes.alpha_w='0.95:1.00:0.05'", "survey.axes.alpha_w='0.81:1.00:0.01'"
"""Orders that make 100 352 and 1 003 520 points."""
ALLOWED_MIB = 45.0
"""The rows alone are 117 MB more."""
LIMIT_MIB = 500e6 / 2.0**20


def parent_mib(folder: Path, orders: str) -> float:
    command = [str(USAGE), "run", "experiment=ic1_outofplane", orders, *GAINS, "scheduler.workers=2", "--quiet"]
    output = run([*command, f"output_dir={folder}"]).output
    return float(output.splitlines()[-1].split()[3])


@pytest.mark.slow
def test_ten_times_the_points_need_hardly_more_memory(tmp_path: Path) -> None:
    few, many = parent_mib(tmp_path, FEW), parent_mib(tmp_path, MANY)
    assert many < LIMIT_MIB
    assert many - few < ALLOWED_MIB
