"""Columns, objectives and controllers as a reader meets them: symbols, words and units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

_MEASURES = {
    "alpha_0": ("", r"\alpha_0"),
    "alpha_1": ("", r"\alpha_1"),
    "nu": ("", r"\nu"),
    "reference_rate": ("", "c"),
    "caputo": ("", r"\mathrm{Caputo}"),
    "settling_2_percent_orbits": ("Settling to 2 % (orbits)", ""),
    "settling_5_percent_orbits": ("Settling to 5 % (orbits)", ""),
    "overshoot_percent": ("Overshoot (%)", ""),
    "theta_settling_orbits": (r"Settling of $\theta$ (orbits)", ""),
    "phi_settling_orbits": (r"Settling of $\varphi$ (orbits)", ""),
    "tension_margin": ("Margin of the demanded tension", ""),
    "thruster_force_max_n": ("Largest force across (N)", ""),
    "beta": ("Weight of the control", r"\beta"),
    "recall": ("Recall", "R"),
    "delay": ("Delay", r"\tau"),
    "periodicity_error": ("Periodicity error", "e"),
    "settling_time": ("Settling time", r"\mathrm{ST}"),
    "overshoot": ("Overshoot", r"\mathrm{OS}"),
    "control_effort": ("Control effort", "U"),
}
_GREEK = {"phi": r"\varphi"}
_PREFIXES = {
    "alpha": r"\alpha_{%s}",
    "lambda": r"\lambda_{%s}",
    "mu": r"\mu_{%s}",
    "time_constant": "T_{f_{%s}}",
    "k_p": "k_{P_{%s}}",
    "k_i": "k_{I_{%s}}",
    "k_d_alpha": r"k_{D^\alpha_{%s}}",
    "k_d": "k_{D_{%s}}",
    "gain": "K_{%s}",
    "control": r"\upsilon_{%s}",
}
"""The first that a column begins with counts."""

_LENGTHS = ((1e3, "km"), (1.0, "m"), (1e-3, "mm"))
_ACCELERATIONS = ((1.0, "m/s²"), (1e-3, "mm/s²"), (1e-6, "µm/s²"))


def symbol(column: str) -> str:
    """Symbol of a column, for use between dollar signs: ``k_p_w`` is k_{P_w}, ``w_dot`` is w'."""
    if column in _MEASURES:
        return _MEASURES[column][1]
    if entry := re.fullmatch(r"gain_(\d)_(\d)", column):
        return f"K_{{{entry[1]}{entry[2]}}}"
    for prefix, form in _PREFIXES.items():
        if column.startswith(f"{prefix}_"):
            return form % _upright(column.removeprefix(f"{prefix}_"))
    if column.endswith("_dot"):
        return f"{_upright(column.removesuffix('_dot'))}'"
    return _upright(column)


def objective(columns: Sequence[str]) -> str:
    """An objective in words: a measure's name, or the geometric mean of several."""
    if len(columns) == 1:
        words, sign = _MEASURES.get(columns[0], (_sentence(columns[0]), ""))
        return f"{words} ${sign}$" if sign else words
    product = r"\cdot ".join(symbol(column) for column in columns)
    return rf"$({product})^{{1/{len(columns)}}}$"


def initial_condition(name: str) -> str:
    """``ic1`` is IC1, ``ic1_tenth`` IC1 tenth, ``rho_1_9`` ρ = 1.9; other names lose their underscores."""
    if found := re.fullmatch(r"rho_(\d+)_(\d+)", name):
        return rf"$\rho = {found[1]}.{found[2]}$"
    first, *rest = name.split("_")
    return " ".join([first.upper() if re.fullmatch(r"ic\d+", first) else first, *rest])


def controller(row: Mapping[str, Any]) -> str:
    """The law of a row of optima, e.g. PD^α with α_w = 0.91; its gains too where there are but two."""
    if "delay" in row:
        rate = row.get("adaptation_rate")
        under_control = "delayed feedback" if rate is None else "adaptive delay" if rate else "fixed delay"
        return under_control if row["gain_factor"] else "free motion"
    orders = [name for name in row if name.startswith(("alpha_", "lambda_", "mu_", "time_constant_"))]
    gains = [name for name in row if name.startswith("k_")]
    shown = orders + (gains if len(gains) <= 2 else [])
    return f"{_law(row)}: " + ", ".join(f"${symbol(name)} = {row[name]:g}$" for name in shown)


def _law(row: Mapping[str, Any]) -> str:
    """Name of the law that has the columns of a row."""

    def has(prefix: str) -> bool:
        return any(name.startswith(prefix) for name in row)

    if has("lambda_"):
        return r"PI$^{\lambda}$D$^{\mu}$"
    if has("time_constant_"):
        return "PID" if has("k_i_") else "PD with lag"
    if has("k_d_alpha_"):
        return r"PDD$^{\alpha}$"
    return "PD" if all(row[name] == 1.0 for name in row if name.startswith("alpha_")) else r"PD$^{\alpha}$"


def power_of_ten(largest: float) -> tuple[float, str]:
    """Power of ten that divides an axis into handy numbers, and what its label then says; 1 from 0.1 to 1000."""
    if largest == 0.0 or 0.1 <= largest < 1e3 or not math.isfinite(largest):
        return 1.0, ""
    exponent = math.floor(math.log10(largest))
    return 10.0**exponent, rf"$\,/\,10^{{{exponent}}}$"


def number(value: float) -> str:
    """A number for use between dollar signs, small and large ones as a power of ten."""
    mantissa, exponent = f"{value:e}".split("e")
    if -3 <= int(exponent) <= 4:
        return f"{value:g}"
    factor = f"{float(mantissa):g}"
    return ("" if factor == "1" else rf"{factor}\times ") + f"10^{{{int(exponent)}}}"


def length_unit(largest_m: float) -> tuple[float, str]:
    """Metres in the unit that suits a length, and its name."""
    return _unit(largest_m, _LENGTHS)


def acceleration_unit(largest_m_s2: float) -> tuple[float, str]:
    """m/s² in the unit that suits an acceleration, and its name."""
    return _unit(largest_m_s2, _ACCELERATIONS)


def _unit(largest: float, ladder: Sequence[tuple[float, str]]) -> tuple[float, str]:
    return next(((size, name) for size, name in ladder if largest >= size), ladder[-1])


def _upright(name: str) -> str:
    if name in _GREEK:
        return _GREEK[name]
    return name if len(name) <= 2 else rf"\mathrm{{{name.replace('_', ' ')}}}".replace(" ", r"\ ")


def _sentence(name: str) -> str:
    words = name.replace("_", " ")
    return words[:1].upper() + words[1:]
