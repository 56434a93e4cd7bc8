"""The figure of poles: eigenvalues with the sector of stability, and the poles that they stand for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex

from fracctl.figures import FigureError, draw, poles
from fracctl.figures.results import Results, select
from fracctl.figures.style import BLUE, ORANGE, style
from fracctl.store import RunDirectory
from tests.figures.synthetic import write_run

SHEETS = 25
"""Denominator of the order 0.96 of the synthetic optimum."""


@pytest.fixture
def run(tmp_path: Path) -> RunDirectory:
    """A stored run whose optimum has the order 24/25, with the roots of w^(2q) + k_D w^(αq) + 1 + k_P."""
    folder = write_run(tmp_path)
    optima = pd.read_parquet(folder / "optima.parquet")
    shown = optima[optima["kind"] != "slice"]
    pd.concat([part for number, row in shown.iterrows() for part in parts(number, row)]).to_parquet(
        folder / "poles.parquet"
    )
    return RunDirectory(folder)


def parts(number: object, row: pd.Series) -> list[pd.DataFrame]:
    q = SHEETS if row["alpha_w"] < 1.0 else 1
    coefficients = np.zeros(2 * q + 1)
    coefficients[[0, -1]] = 1.0, 1.0 + row["k_p_w"]
    coefficients[2 * q - round(row["alpha_w"] * q)] += row["k_d_w"]
    values = np.roots(coefficients)
    sheet = values[q * np.abs(np.angle(values)) < np.pi] if q > 1 else values
    return [
        pd.DataFrame({"run": number, "variable": name, "denominator": d, "real": v.real, "imag": v.imag})
        for name, d, v in (("sigma", 1, sheet**q), ("w", q, values))
    ]


def marked(ax: Axes, marker: str, colour: str) -> np.ndarray:
    lines = [line for line in ax.lines if line.get_marker() == marker and to_hex(line.get_color()) == colour.lower()]
    return np.concatenate([line.get_xdata() + 1j * np.asarray(line.get_ydata()) for line in lines])


def test_eigenvalues_on_the_principal_sheet_are_the_poles(run: RunDirectory) -> None:
    results = Results(run)
    with style():
        figure, table = poles.build(results, select(results, {}))
    left, right = figure.axes[:2]
    (inset,) = left.child_axes
    everything = table[(table["kind"] == "overall") & (table["variable"] == "w")]
    assert len(everything) == 2 * SHEETS
    coloured = marked(inset, "x", BLUE)
    np.testing.assert_array_equal(np.sort_complex(coloured), np.sort_complex(marked(left, "o", BLUE)))
    assert np.all(np.abs(np.angle(coloured)) < np.pi / SHEETS)
    assert len(coloured) == everything["principal"].sum()
    np.testing.assert_allclose(np.sort_complex(coloured**SHEETS), np.sort_complex(marked(right, "x", BLUE)), rtol=1e-9)
    assert np.all(marked(right, "x", BLUE).real < 0.0)
    assert len(marked(right, "+", ORANGE)) == 2
    low, high = inset.get_ylim()
    assert low < coloured.imag.min() < coloured.imag.max() < high


def test_the_sector_of_stability_is_what_is_left_shaded(run: RunDirectory) -> None:
    """White is the wedge |arg w| < π/(2q), to its very edge."""
    results = Results(run)
    with style():
        figure, _ = poles.build(results, select(results, {}))
    (wedge,) = figure.axes[0].patches
    for angle, inside in ((0.0, True), (0.49, True), (-0.49, True), (0.51, False), (-0.51, False), (3.0, False)):
        point = np.exp(1j * np.pi * angle / SHEETS)
        assert wedge.get_path().contains_point((point.real, point.imag)) is inside


def test_the_plane_of_integer_orders_is_that_of_the_poles(run: RunDirectory) -> None:
    """Where PD is the best law, w is σ, and shaded is the left half plane."""
    optima = pd.read_parquet(run.optima_path)
    optima.loc[optima["kind"] == "overall", "kind"] = "other"
    optima.to_parquet(run.optima_path)
    results = Results(run)
    with style():
        figure, table = poles.build(results, select(results, {}))
    left, right = figure.axes[:2]
    assert set(table["kind"]) == {"baseline"}
    assert left.child_axes == []
    np.testing.assert_allclose(
        np.sort_complex(marked(left, "+", ORANGE)), np.sort_complex(marked(right, "+", ORANGE)), rtol=1e-12
    )
    for point, stable in (((-0.1, 0.9), True), ((0.1, 0.9), False), ((0.1, -0.9), False)):
        assert any(patch.get_path().contains_point(point) for patch in left.patches) is not stable


def test_files_and_a_table(run: RunDirectory) -> None:
    assert {path.suffix for path in draw(run, {"poles": {"type": "poles"}})} == {".pdf", ".png", ".csv"}


def test_orders_without_a_common_denominator(run: RunDirectory) -> None:
    table = pd.read_parquet(run.poles_path)
    table[table["variable"] == "sigma"].to_parquet(run.poles_path)
    results = Results(run)
    with style():
        figure, _ = poles.build(results, select(results, {}))
    assert "without a" in figure.axes[0].texts[0].get_text()


def test_a_run_without_poles_gets_a_sentence(run: RunDirectory) -> None:
    run.poles_path.unlink()
    with pytest.raises(FigureError, match="figure 'poles': the run holds no poles"):
        draw(run, {"poles": {"type": "poles"}})
