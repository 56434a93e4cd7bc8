"""A small stored run of known content: damped oscillators in the columns of an out-of-plane grid."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

THRESHOLD = 1e-5
HORIZON_PERIODS = 6.0
INITIAL_STATES = {"ic1": (0.0, 0.002), "ic2": (-0.001, 0.0), "ic3": (0.001, -0.002)}
OBJECTIVES = {"settling_time": ["settling_time"], "st_os_u": ["settling_time", "overshoot", "control_effort"]}


def effective(alpha: np.ndarray, k_p: np.ndarray, k_d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Damping and stiffness of the oscillator that stands in for the fractional loop; exact at alpha = 1."""
    omega = np.sqrt(1.0 + k_p)
    angle = 0.5 * np.pi * alpha
    return k_d * omega ** (alpha - 1.0) * np.sin(angle), 1.0 + k_p + k_d * omega**alpha * np.cos(angle)


def oscillator(damping: np.ndarray, stiffness: np.ndarray, state: tuple[float, float], times: np.ndarray) -> np.ndarray:
    """w of w'' + damping w' + stiffness w = 0, (b, t)."""
    decay = 0.5 * damping[:, None]
    frequency = np.sqrt((stiffness[:, None] - decay**2).astype(complex) + 1e-12)
    value, rate = state
    wave = value * np.cos(frequency * times) + (rate + decay * value) * np.sin(frequency * times) / frequency
    return np.exp(-decay * times) * wave.real


def write_run(
    folder: Path,
    gains: Iterable[float] = np.linspace(0.0, 2.0, 9),
    alphas: Iterable[float] = (0.96, 1.0),
    names: Iterable[str] = ("ic1",),
) -> Path:
    """Write run.json and the three tables; return the folder."""
    gains, alphas, names = np.asarray(list(gains)), np.asarray(list(alphas)), list(names)
    folder.mkdir(parents=True, exist_ok=True)
    evaluations = pd.concat([_evaluations(gains, alphas, name) for name in names], ignore_index=True)
    optima = _optima(evaluations, alphas, names)
    evaluations.to_parquet(folder / "evaluations.parquet")
    optima.to_parquet(folder / "optima.parquet")
    shown = optima[optima["kind"] != "slice"]
    pd.concat([_trajectory(run, row) for run, row in shown.iterrows()], ignore_index=True).to_parquet(
        folder / "trajectories.parquet"
    )
    (folder / "run.json").write_text(
        json.dumps({"status": "done", "configuration": _configuration(gains, alphas, names)})
    )
    return folder


def _evaluations(gains: np.ndarray, alphas: np.ndarray, name: str) -> pd.DataFrame:
    alpha, k_p, k_d = (axis.ravel() for axis in np.meshgrid(alphas, gains, gains, indexing="ij"))
    times = np.linspace(0.0, math.tau * HORIZON_PERIODS, 3001)
    damping, stiffness = effective(alpha, k_p, k_d)
    w = oscillator(damping, stiffness, INITIAL_STATES[name], times)
    outside = np.abs(w) > THRESHOLD
    last = w.shape[1] - 1 - np.argmax(outside[:, ::-1], axis=1)
    settled = ~outside[:, -1]
    settling = np.where(settled, times[last], np.inf)
    state = INITIAL_STATES[name]
    excursion = (-np.sign(state[0]) * w).max(axis=1) if state[0] else np.abs(w).max(axis=1)
    overshoot = 1.0 + 1e4 * np.maximum(excursion, 0.0)
    rate = np.gradient(w, times, axis=1)
    unusable = ~settled | (k_p + k_d == 0.0)
    effort = np.abs(k_p[:, None] * w + k_d[:, None] * rate).sum(axis=1) * times[1]
    return pd.DataFrame(
        {
            "initial_condition": name,
            "alpha_w": alpha,
            "k_p_w": k_p,
            "k_d_w": k_d,
            "settling_time": settling,
            "overshoot": overshoot,
            "control_effort": effort,
            "objective": settling,
            "objective_settling_time": settling,
            "objective_st_os_u": np.where(
                unusable, np.inf, np.cbrt(np.where(unusable, 1.0, settling) * overshoot * effort)
            ),
            "status": np.where(settled, "ok", "unsettled"),
            "stable": np.where(k_d > 0.0, True, None),
            "error_estimate": 1e-9,
            "nodes": 80,
        }
    )


def _optima(evaluations: pd.DataFrame, alphas: np.ndarray, names: list[str]) -> pd.DataFrame:
    rows = []
    for objective in OBJECTIVES:
        for name in names:
            points = evaluations[evaluations["initial_condition"] == name]
            cuts = [("slice", alpha, points[points["alpha_w"] == alpha]) for alpha in alphas]
            cuts += [("overall", None, points), ("baseline", None, points[points["alpha_w"] == 1.0])]
            for kind, cut, part in cuts:
                best = part.loc[part[f"objective_{objective}"].idxmin()]
                rows.append({"kind": kind, "slice": cut, "objective_name": objective, **best.to_dict()})
    return pd.DataFrame(rows)


def _trajectory(run: object, row: pd.Series) -> pd.DataFrame:
    times = np.linspace(0.0, math.tau * HORIZON_PERIODS, 801)
    parts = [np.array([row[name]]) for name in ("alpha_w", "k_p_w", "k_d_w")]
    damping, stiffness = effective(*parts)
    fine = np.linspace(0.0, times[-1], 16001)
    w = oscillator(damping, stiffness, INITIAL_STATES[row["initial_condition"]], fine)[0]
    rate = np.gradient(w, fine)
    table = {"run": run, "time": times, "w": w[::20], "w_dot": rate[::20]}
    return pd.DataFrame({**table, "control_w": -row["k_p_w"] * table["w"] - row["k_d_w"] * table["w_dot"]})


def _configuration(gains: np.ndarray, alphas: np.ndarray, names: list[str]) -> dict[str, object]:
    step = gains[1] - gains[0]
    gain_axis = f"{gains[0]:g}:{gains[-1]:g}:{step:g}"
    chief = {"semi_major_axis_km": 1e4, "inclination_deg": 20.0, "gravitational_parameter_km3_s2": 398600.4418}
    return {
        "name": "synthetic",
        "plant": {"type": "hcw_out_of_plane", "chief": chief},
        "controller": {"type": "pd_alpha", "alpha_w": 1.0, "k_p_w": 0.55, "k_d_w": 2.0},
        "initial_condition": {name: {"units": "dimensionless"} for name in names},
        "measures": {"settling_time": {"threshold": THRESHOLD, "resolution": None}},
        "objectives": OBJECTIVES,
        "objective": "settling_time",
        "horizon_periods": HORIZON_PERIODS,
        "survey": {
            "type": "grid",
            "axes": {"alpha_w": list(map(float, alphas)), "k_p_w": gain_axis, "k_d_w": gain_axis},
            "slice": "alpha_w",
            "baseline": {"alpha_w": 1.0},
        },
        "figures": {},
    }
