"""What a study of the solvers found, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fracctl.arrays import Array, Booleans, Floats

USUAL = {"collocation": 64.0, "volterra": 32.0, "contour": 1e-8}
"""Resolutions that are told of, or the nearest ones there are."""


def findings(rows: Mapping[str, Array], orders: Sequence[str]) -> list[str]:
    """Return a sentence on each solver at its usual resolution, and one on collocation order by order.

    Args:
        rows: of an accuracy evaluation.
        orders: columns of the orders of the derivative.
    """
    errors = np.maximum(rows["error"], rows["control_error"])
    usual = {name: chosen for name in USUAL if (chosen := _usual(rows, name)).any()}
    if not usual:
        return []
    worst = [f"{_setting(rows, chosen)}: {errors[chosen].max():.1e}" for chosen in usual.values()]
    sentences = [f"largest error of positions and controls over their peaks, {', '.join(worst)}"]
    if orders and "collocation" in usual:
        sentences += _by_order(rows, usual["collocation"], orders)
    return sentences


def _by_order(rows: Mapping[str, Array], chosen: Booleans, orders: Sequence[str]) -> list[str]:
    errors: Floats = rows["error"]
    condition = rows["initial_condition"][np.flatnonzero(chosen)[np.argmax(errors[chosen])]]
    chosen = chosen & (rows["initial_condition"] == condition)
    alpha = np.max([rows[name] for name in orders], axis=0)
    each = [f"{errors[chosen & (alpha == a)].max():.1e} at order {a:g}" for a in np.unique(alpha[chosen])]
    why = "a polynomial cannot follow the non-integer power of time with which a fractional loop starts"
    return [f"{_setting(rows, chosen)} is off from {condition} by {', '.join(each)}: {why}"]


def _usual(rows: Mapping[str, Array], solver: str) -> Booleans:
    of_solver: Booleans = rows["solver"] == solver
    if not of_solver.any():
        return of_solver
    resolutions = np.unique(rows["resolution"][of_solver].astype(float))
    nearest = resolutions[np.argmin(np.abs(np.log(resolutions / USUAL[solver])))]
    chosen: Booleans = of_solver & (rows["resolution"] == nearest)
    return chosen


def _setting(rows: Mapping[str, Array], chosen: Booleans) -> str:
    solver, resolution = rows["solver"][chosen][0], float(rows["resolution"][chosen][0])
    return f"{solver} with {'tolerance' if solver == 'contour' else 'N ='} {resolution:g}"
