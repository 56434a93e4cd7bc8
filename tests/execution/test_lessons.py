"""What the notes teach, against loops solved one by one with the library."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import fracctl as fc
from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.execution.lessons import lessons
from fracctl.plants import HCWOutOfPlane

START = [0.0, 0.002]
HORIZON = 12.0 * math.pi


def taught(design: dict[str, float], *words: str, condition: str = "ic1") -> list[str]:
    """The lessons of a run whose optimum is a design point."""
    experiment = [] if "survey=search" in words else ["experiment=ic1_outofplane"]
    config = compose([*experiment, *words])
    evaluation, _ = build_checked(config)
    rows = evaluation({name: np.array([value]) for name, value in design.items()})
    optimum = {name: values[0].item() if hasattr(values[0], "item") else values[0] for name, values in rows.items()}
    found: list[dict[str, Any]] = [
        {"initial_condition": condition, "objective_name": evaluation.objective, "optimum": optimum},
        {"initial_condition": condition, "objective_name": "another", "optimum": optimum},
        {"initial_condition": "none", "objective_name": evaluation.objective, "optimum": None},
    ]
    return list(lessons(evaluation, config.model_dump(mode="json"), found))


def settling_time(alpha: float, k_p: float, k_d: float) -> float:
    loop = fc.ClosedLoop(HCWOutOfPlane(), fc.controllers.PDAlpha(k_p, k_d, alpha))
    return float(fc.measures.settling_time(fc.solve(loop, START, HORIZON), threshold=1e-5))


OPTIMUM = {"alpha_w": 0.91, "k_p_w": 0.85, "k_d_w": 2.0}


def test_an_optimum_at_the_end_of_an_axis_is_told() -> None:
    (end,) = [note for note in taught(OPTIMUM) if "end of" in note]
    assert end == (
        "ic1, settling_time: k_d_w = 2 is the upper end of survey.axes.k_d_w; a wider one may hold a better optimum"
    )


@pytest.mark.parametrize(
    ("design", "words", "ends"),
    [
        (OPTIMUM, ["survey.axes.k_d_w=0:3:0.05"], []),
        (OPTIMUM | {"k_p_w": 0.5}, ["survey.axes.k_p_w=0.5:2:0.1"], ["k_p_w", "k_d_w"]),
        (OPTIMUM | {"alpha_w": 1.0}, [], ["k_d_w"]),  # an order cannot exceed 1
        (OPTIMUM, ["survey.axes.k_d_w=2"], []),
        (OPTIMUM, ["survey.axes.k_d_w=[1,2]"], []),
        (OPTIMUM, ["survey=search", "survey.bounds.gains=[0,2]"], ["k_d_w"]),
        (OPTIMUM | {"alpha_w": 0.8}, ["survey=search", "survey.bounds.orders=[0.8,1]"], ["alpha_w"]),
    ],
)
def test_ends_that_could_be_moved_are_told_and_no_others(
    design: dict[str, float], words: list[str], ends: list[str]
) -> None:
    found = [note.split(": ")[1].split(" ")[0] for note in taught(design, *words) if "end of" in note]
    assert found == ends


@pytest.mark.parametrize("design", [OPTIMUM, {"alpha_w": 1.0, "k_p_w": 0.55, "k_d_w": 2.0}])
def test_how_much_a_gain_that_is_off_changes(design: dict[str, float]) -> None:
    (note,) = [note for note in taught(design) if "one gain off" in note]
    low, high, name, sign = re.findall(r"by (\S+) to (\S+) % \(most with (\w+) ([+-]) 0.05\)", note)[0]
    alpha, k_p, k_d = design.values()
    best = settling_time(alpha, k_p, k_d)
    off = {
        ("k_p_w", "+"): settling_time(alpha, k_p + 0.05, k_d),
        ("k_p_w", "-"): settling_time(alpha, k_p - 0.05, k_d),
        ("k_d_w", "+"): settling_time(alpha, k_p, k_d + 0.05),
        ("k_d_w", "-"): settling_time(alpha, k_p, k_d - 0.05),
    }
    percent = {key: 100.0 * (value / best - 1.0) for key, value in off.items()}
    assert float(low) == pytest.approx(min(percent.values()), abs=0.06)
    assert float(high) == pytest.approx(max(percent.values()), abs=0.06)
    assert (name, sign) == max(percent, key=lambda key: abs(percent[key]))


def test_a_gain_without_which_nothing_settles_is_told() -> None:
    (note,) = [note for note in taught({"alpha_w": 1.0, "k_p_w": 0.5, "k_d_w": 0.3}) if "one gain off" in note]
    assert "with one gain off by 0.05 it may not settle (k_d_w - 0.05)" in note
    assert not any("one gain off" in note for note in taught({"alpha_w": 1.0, "k_p_w": 0.5, "k_d_w": 0.2}))


def test_the_peak_is_told_in_units() -> None:
    loop = fc.ClosedLoop(HCWOutOfPlane(), fc.controllers.PDAlpha(0.85, 2.0, 0.91))
    trajectory = fc.solve(loop, START, HORIZON)
    scale = HCWOutOfPlane().scales.acceleration_m_s2  # type: ignore[union-attr]
    peak = scale * np.abs(trajectory.control(np.linspace(0.0, 12.0, 20001))).max()
    (note,) = [note for note in taught(OPTIMUM, "spacecraft.mass_kg=200") if "peaks" in note]
    said = re.findall(r"peaks at (\S+) mm/s², (\S+) N for 200 kg$", note)[0]
    assert [float(word) for word in said] == pytest.approx([1e3 * peak, 200.0 * peak], rel=5e-3)
    assert any(note.endswith("mm/s²") for note in taught(OPTIMUM))


def test_loops_that_are_not_linear_are_not_solved_again() -> None:
    limited = ["solver=explicit_memory", "evaluation.largest_control=0.002", "figures=null", "solver.cross_check=0"]
    config = compose(["experiment=ic1_outofplane", *limited])
    evaluation, _ = build_checked(config)
    optimum = OPTIMUM | {"initial_condition": "ic1", "settling_time": 3.0}
    found = [{"initial_condition": "ic1", "objective_name": evaluation.objective, "optimum": optimum}]
    (note,) = lessons(evaluation, config.model_dump(mode="json"), found)
    assert "k_d_w = 2 is the upper end" in note
