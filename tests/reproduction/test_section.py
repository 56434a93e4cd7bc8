"""A section from its runs to its table, on a grid that holds the published optima, and on the full one."""

from __future__ import annotations

import csv
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

from fracctl.errors import ConfigurationError, RunError
from fracctl.reproduction.section import Reproduction, reproduce
from fracctl.reproduction.suites import Suite, read_suite
from fracctl.reproduction.table import HEADINGS, cells, conclusion, records, sentence, write

SMALL_GRID = [
    "survey.axes.alpha_w=[0.91,0.97,1.0]",
    "survey.axes.k_p_w=[0,0.45,0.55,0.75,0.8,0.85,1.05,2.0]",
    "survey.axes.k_d_w=[1.95,2.0]",
    "scheduler=serial",
    "figures=null",
]


@pytest.fixture(scope="module")
def suite() -> Suite:
    return read_suite("fractional_hcw")


@pytest.fixture(scope="module")
def output_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("outputs")


@pytest.fixture(scope="module")
def result(suite: Suite, output_dir: Path) -> Reproduction:
    return reproduce(suite, "out_of_plane", [*SMALL_GRID, f"output_dir={output_dir}"])


def check(result: Reproduction) -> None:
    """Every verdict is the expected one, and what is printed exactly is computed exactly."""
    assert {row.published.id: row.verdict for row in result.rows} == {
        row.published.id: row.published.expected for row in result.rows
    }
    assert result.failures == []
    for row in result.rows:
        assert row.computed is not None
        assert row.exact is not None
        if row.published.id.endswith(("_alpha", "_k_p", "_k_d")) and row.difference is not None:
            assert row.difference == 0
            assert row.computed == row.exact


def test_the_published_numbers_come_out(result: Reproduction) -> None:
    check(result)
    assert result.name == "fractional_hcw/out_of_plane"
    assert result.counts == {"reproduced": 50, "not_reproduced": 1, "not_decidable": 0}
    assert conclusion(result).endswith("1 not reproduced, 0 not decidable; every row that must hold does")


def test_the_exact_values_stand_beside(result: Reproduction) -> None:
    """IC1, α = 0.91: samples 0.01 apart against arbitrary precision."""
    rows = {row.published.id: row for row in result.rows}
    effort = rows["ic1_psi_frac_control_effort"]
    assert effort.computed == pytest.approx(2.638004, abs=5e-7)
    assert effort.exact == pytest.approx(2.64975, abs=5e-6)
    assert effort.difference == Decimal("0.0010")
    settling = rows["ic1_psi_frac_settling_time"]
    assert settling.computed == pytest.approx(3.01, abs=1e-12)
    assert settling.exact == pytest.approx(3.01276, abs=5e-6)


def test_stored_runs_are_used_again(suite: Suite, output_dir: Path, result: Reproduction) -> None:
    again = reproduce(suite, "out_of_plane", [*SMALL_GRID, f"output_dir={output_dir}"])
    assert all(run.reused for runs in again.runs.values() for run in runs.values())
    assert records(again) == records(result)
    directories = {run.run_directory for runs in result.runs.values() for run in runs.values()}
    assert len(directories) == 2, "sampled and exact are runs of their own"


def test_the_files(result: Reproduction, output_dir: Path) -> None:
    assert write(result) == output_dir / "reproduce" / "fractional_hcw" / "out_of_plane"
    rows = records(result)
    with (result.directory / "table.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["id"] for line in lines] == [row["id"] for row in rows]
    assert [float(line["computed"]) for line in lines] == [row["computed"] for row in rows]
    assert lines[2]["published"] == "2.0"
    table = pq.read_table(result.directory / "table.parquet", page_checksum_verification=True)
    assert table.to_pylist() == rows
    frame = pd.read_parquet(result.directory / "table.parquet")
    assert frame["difference"].isna().sum() == sum(row.published.published.relation != "=" for row in result.rows)
    text = (result.directory / "table.md").read_text(encoding="utf-8")
    body = [line for line in text.splitlines() if line.startswith("|")]
    assert len(body) == len(rows) + 2
    assert len({line.replace("\\|", "").count("|") for line in body}) == 1
    assert conclusion(result) in text
    assert all(str(run.run_directory) in text for runs in result.runs.values() for run in runs.values())


def test_cells_and_sentence(result: Reproduction) -> None:
    row = next(row for row in result.rows if row.published.id == "ic1_psi_frac_control_effort")
    *shown, reason = cells(row)
    assert len(HEADINGS) == len(shown) + 1
    expected = ["ic1_psi_frac_control_effort", "2.637", "1e-3", "2.6380", "2.6498", "+0.0010", "reproduced"]
    assert shown == expected
    assert reason.startswith("One whole unit off")
    said = "(table IC1) is published as 2.637 1e-3, computed 2.6380, exact 2.6498"
    assert said in sentence(row)
    nothing = replace(row, computed=None, exact=None, difference=None, verdict="not_reproduced")
    assert cells(nothing)[3:7] == ["-", "-", "", "not_reproduced"]


def test_other_numbers_are_failures_and_surprises(suite: Suite, output_dir: Path) -> None:
    """Without α = 0.91 and 0.97 the published optima are not found."""
    coarse = ["survey.axes.alpha_w=[0.95,1.0]", *SMALL_GRID[1:], f"output_dir={output_dir}"]
    result = reproduce(suite, "out_of_plane", coarse)
    failed = {row.published.id for row in result.failures}
    assert {"ic1_st_frac_alpha", "ic1_st_settling_time_reduction", "ic2_psi_frac_alpha"} <= failed
    assert not failed & {"ic1_st_pd_settling_time", "ic1_psi_pd_overshoot", "stable", "ic2_psi_overshoot_reduction"}
    assert f"{len(failed)} that must hold do not" in conclusion(result)


def test_a_point_without_optimum_fails(suite: Suite, output_dir: Path) -> None:
    """Within a tenth of an orbit nothing settles."""
    result = reproduce(suite, "out_of_plane", [*SMALL_GRID, "horizon_periods=0.1", f"output_dir={output_dir}"])
    row = next(row for row in result.rows if row.published.id == "ic1_st_frac_alpha")
    assert row.computed is None
    assert row.fails


def test_an_unexpected_success_is_a_surprise(result: Reproduction) -> None:
    row = result.rows[0]
    stale = replace(row, published=replace(row.published, expected="not_reproduced"))
    assert (stale.surprises, stale.fails) == (True, False)
    assert (row.surprises, row.fails) == (False, False)


def test_what_goes_wrong_below_is_passed_on(
    suite: Suite, output_dir: Path, monkeypatch: pytest.MonkeyPatch, result: Reproduction
) -> None:
    with pytest.raises(ConfigurationError, match="alhpa_w"):
        reproduce(suite, "out_of_plane", ["survey.axes.alhpa_w=1"])
    run = next(iter(result.runs["exact"].values()))
    incomplete = replace(run, summary=run.summary | {"error": "3 points could not be computed"})
    monkeypatch.setattr("fracctl.reproduction.section.execute", lambda config, **_: incomplete)
    with pytest.raises(RunError, match="outofplane: 3 points could not be computed"):
        reproduce(suite, "out_of_plane", [f"output_dir={output_dir}"])


@pytest.mark.slow
def test_the_full_survey(suite: Suite, tmp_path: Path) -> None:
    check(reproduce(suite, "out_of_plane", [f"output_dir={tmp_path}"]))


@pytest.mark.slow
def test_what_the_in_plane_paper_lets_decide_comes_out(suite: Suite, output_dir: Path) -> None:
    result = reproduce(suite, "in_plane", [f"output_dir={output_dir}", "figures=null"])
    assert result.failures == []
    assert result.counts == {"reproduced": 28, "not_reproduced": 3, "not_decidable": 34}
    for row in result.rows:
        if row.published.id.startswith(("lqr_k", "ic1_st_os_pd_k")):
            assert row.difference == 0
