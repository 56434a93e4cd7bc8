"""Bode and Nyquist plots: what they draw is the stored loop gain, and what they mark are its margins."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.patches import Circle

from fracctl.controllers import PDAlpha
from fracctl.figures import FigureError, bode, draw, nyquist
from fracctl.figures.loop_gain import LoopGain, loop_gains
from fracctl.figures.results import Results, select
from fracctl.figures.style import BLUE, ORANGE, render, style
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWOutOfPlane
from fracctl.stability import Margins, margins
from fracctl.store import RunDirectory
from tests.figures.synthetic import write_run

FIGURES = {"bode": {"type": "bode"}, "nyquist": {"type": "nyquist"}}


@pytest.fixture
def run(tmp_path: Path) -> RunDirectory:
    """A stored run with L(iω) = (k_P + k_D (iω)^α) / (1 - ω²) of its optima."""
    folder = write_run(tmp_path)
    optima = pd.read_parquet(folder / "optima.parquet")
    shown = optima[optima["kind"] != "slice"]
    pd.concat([part(number, row) for number, row in shown.iterrows()]).to_parquet(folder / "frequency_response.parquet")
    return RunDirectory(folder)


def part(number: object, row: pd.Series) -> pd.DataFrame:
    omega = np.geomspace(0.01, 100.0, 3000)
    loop = (row["k_p_w"] + row["k_d_w"] * (1j * omega) ** row["alpha_w"]) / (1.0 - omega**2)
    sensitivity = 1.0 / np.abs(1.0 + loop)
    columns = {"loop_real": loop.real, "loop_imag": loop.imag, "sensitivity": sensitivity}
    return pd.DataFrame({"run": number, "frequency": omega, **columns, "complementary": np.abs(loop) * sensitivity})


def expected(run: RunDirectory, kind: str) -> Margins:
    optima = run.optima()
    row = optima[(optima["kind"] == kind) & (optima["objective_name"] == "settling_time")].iloc[0]
    return margins(ClosedLoop(HCWOutOfPlane(), PDAlpha(row["k_p_w"], row["k_d_w"], row["alpha_w"])))


def dots(ax: Axes, colour: str) -> list[tuple[float, float]]:
    marked = [line for line in ax.lines if line.get_marker() == "o" and to_hex(line.get_color()) == colour.lower()]
    return [(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in marked]


@pytest.mark.parametrize(("kind", "colour"), [("overall", BLUE), ("baseline", ORANGE)])
def test_the_phase_margin_is_marked(run: RunDirectory, kind: str, colour: str) -> None:
    wanted = expected(run, kind)
    results = Results(run)
    with style():
        figure, table = bode.build(results, select(results, {}))
        plane, _ = nyquist.build(results, select(results, {}))
    above, below = figure.axes[:2]
    ((omega, size),) = dots(above, colour)
    ((_, phase),) = dots(below, colour)
    assert (omega, size) == (pytest.approx(wanted.crossover, rel=1e-3), 1.0)
    assert 180.0 - abs(phase) == pytest.approx(wanted.phase_margin_deg, abs=0.05)
    notes = [text.get_text() for text in below.texts if to_hex(text.get_color()) == colour.lower()]
    assert notes == [f"{180.0 - abs(phase):.1f}°"]
    ((real, imag),) = dots(plane.axes[0], colour)
    assert np.angle(real + 1j * imag, deg=True) == pytest.approx(phase)
    assert set(table["kind"]) == {"overall", "baseline"}


def test_the_circles_touch_the_curves(run: RunDirectory) -> None:
    """1/M_s is the distance of the curve from -1."""
    results = Results(run)
    with style():
        figure, table = nyquist.build(results, select(results, {}))
    (ax,) = figure.axes
    circles = {to_hex(c.get_edgecolor()): c for c in ax.patches if isinstance(c, Circle) and c.center[0] == -1.0}
    for kind, colour in (("overall", BLUE), ("baseline", ORANGE)):
        rows = table[table["kind"] == kind]
        distance = np.abs(rows["real"] + 1j * rows["imag"] + 1.0).min()
        assert circles[colour.lower()].radius == pytest.approx(min(1.0, distance), rel=1e-12)
        assert circles[colour.lower()].radius == pytest.approx(1.0 / expected(run, kind).sensitivity_peak, rel=1e-3)


def test_the_curve_is_broken_where_it_passes_through_infinity(run: RunDirectory) -> None:
    results = Results(run)
    with style():
        figure, _ = nyquist.build(results, select(results, {}))
    for line in figure.axes[0].lines:
        if len(line.get_xdata()) > 100:
            assert np.isnan(line.get_xdata()).sum() == 1


def test_frequencies_in_hertz(run: RunDirectory) -> None:
    """1/n is 1583.9 s: one revolution is 0.1 mHz."""
    results = Results(run)
    with style():
        figure, _ = bode.build(results, select(results, {}))
        render(figure)
    (top,) = figure.axes[0].child_axes
    assert np.array(top.get_xlim()) == pytest.approx(np.array([0.01, 100.0]) * 1e3 / (2.0 * np.pi * 1583.9), rel=1e-4)


def test_a_gain_margin() -> None:
    """L = 2 / (s + 1)³ has |L| = 1/4 at ω = √3."""
    omega = np.geomspace(0.01, 100.0, 4000)
    gain = LoopGain("overall", {}, omega, 2.0 / (1j * omega + 1.0) ** 3, np.ones(4000))
    assert gain.gain_margin == pytest.approx((np.sqrt(3.0), 0.25), rel=1e-5)
    assert gain.phase_margin == pytest.approx(
        (np.sqrt(2.0 ** (2.0 / 3.0) - 1.0), -3.0 * np.degrees(np.arctan(np.sqrt(2.0 ** (2.0 / 3.0) - 1.0)))), rel=1e-5
    )
    quiet = LoopGain("overall", {}, omega, 0.5 / (1j * omega + 1.0), np.ones(4000))
    assert quiet.phase_margin is None
    assert quiet.gain_margin is None


def test_files(run: RunDirectory) -> None:
    paths = draw(run, FIGURES)
    assert {path.name for path in paths} == {f"{name}.{kind}" for name in FIGURES for kind in ("pdf", "png", "csv")}


def test_a_baseline_that_is_the_optimum_is_drawn_once(run: RunDirectory) -> None:
    optima = pd.read_parquet(run.optima_path)
    overall = optima["kind"] == "overall"
    optima.loc[optima["kind"] == "baseline"] = optima[overall].assign(kind="baseline").to_numpy()
    optima.to_parquet(run.optima_path)
    results = Results(run)
    assert [gain.kind for gain in loop_gains(results, select(results, {}), "ic1")] == ["baseline"]


def test_what_cannot_be_drawn_gets_a_sentence(run: RunDirectory) -> None:
    trajectories = pd.read_parquet(run.trajectories_path)
    trajectories.assign(control_v=0.0).to_parquet(run.trajectories_path)
    with pytest.raises(FigureError, match="figure 'bode': a Bode plot is for one control; take nyquist"):
        draw(run, FIGURES)
    run.frequency_response_path.unlink()
    with pytest.raises(FigureError, match="figure 'nyquist': the run holds no frequency responses"):
        draw(run, FIGURES)
