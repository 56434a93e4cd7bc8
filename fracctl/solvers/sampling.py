"""Grids on which solutions with powers of time at 0 are sampled: a logarithmic panel, then panels of growing length."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from fracctl.panels import Panel

FIRST_TIME = 1e-10
"""First time of the first panel, relative to the horizon: one for all grids, so that they can be exchanged."""
_LARGEST_RATIO = 8.0
LOGARITHMIC_NODES = 24


def graded_panels(
    first: float, edge: float, end: float, waves: Callable[[float, float], float], accuracy: float
) -> list[Panel]:
    """Return a logarithmic panel [first, edge], then linear ones up to `end`.

    Args:
        first: first time.
        edge: time up to which the solution is a short sum of powers.
        end: last time.
        waves: half the phase in rad of the fastest oscillation between two times.
        accuracy: relative error of the interpolation of powers of time.
    """
    count = max(int(np.ceil(np.log(end / edge) / np.log(_LARGEST_RATIO))), 1)
    edges = edge * (end / edge) ** (np.arange(count + 1) / count)
    edges[-1] = end
    panels = [Panel(first, float(edges[0]), LOGARITHMIC_NODES, logarithmic=True)]
    for a, b in itertools.pairwise(edges):
        panels.append(Panel(float(a), float(b), panel_nodes(float(b / a), waves(float(a), float(b)), accuracy)))
    return panels


def panel_nodes(ratio: float, waves: float, accuracy: float) -> int:
    """Return how many nodes a panel needs whose end is `ratio` times its start.

    Polynomials converge by the ellipse of Bernstein through time 0, where powers of time are singular, once there are
    more nodes than half the phase of the oscillation, by the width of the transition of Bessel functions.
    """
    centre = (ratio + 1.0) / (ratio - 1.0)
    powers = -np.log(accuracy) / np.log(centre + np.sqrt(centre**2 - 1.0))
    return int(np.ceil(max(powers, waves + 9.5 * waves ** (1.0 / 3.0), 10.0)))
