"""Volterra collocation: the highest derivatives as unknowns, with the leading powers of time taken out.

With g = D^ℓ y, ℓ the highest order of each coordinate (2 for positions, 1 for auxiliary states), every term of the loop
is a known power of time plus a fractional integral of g: an equation of the second kind, well conditioned whatever the
number of nodes. Near 0 the solution is a sum of powers t^e with exponents that are no integers; those up to
`LARGEST_POWER` are known from a recursion (`fracctl.fractional.series`), and polynomials converge fast to the rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.special import rgamma

from fracctl.arrays import Array, Floats, share
from fracctl.errors import ArgumentError, UnsupportedError
from fracctl.fractional.series import PowerSeries, short_time_series
from fracctl.fractional.system import LinearFractionalSystem, order_margin
from fracctl.solvers.base import SolvedMembers
from fracctl.solvers.batched import BatchSolver
from fracctl.solvers.members import Members, whole
from fracctl.solvers.outputs import Values, values
from fracctl.solvers.results import packed, without_trajectory
from fracctl.solvers.volterra.panels import UniformPanels
from fracctl.solvers.volterra.solution import Solution

LARGEST_POWER = 7.0
"""Largest exponent of time that is taken out."""
_LEAST_MARGIN = 0.15
"""By how much orders lie below the highest ones, for the powers of time to be few."""
_FEWEST_NODES, _MOST_NODES = 4, 64
_MOST_PANELS = 128
_LARGEST_CHUNK = 2_000_000
"""Entries of the arrays that are worked on at once."""
_PANEL_COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128)
"""Few values, so that few sets of matrices are made."""
_LONGEST = 16.0
"""Length of a panel times the pole radius, beyond which powers of time cancel."""
_ROUNDING = 4.0 * np.finfo(float).eps


class Volterra(BatchSolver):
    """Collocation of the equations of second kind for the highest derivatives, on panels of equal length.

    Solves linear loops with terms whose orders lie in [-1, 1.85] (up to 0.85 of auxiliary states). The error is
    estimated by twice the difference from the solution with 7/8 of the nodes, and not below the rounding of the
    powers of time, which grow with the length of a panel where the solution does not. Members that miss the tolerance
    are solved again on twice as many panels.

    Args:
        nodes: N, Chebyshev-Gauss-Lobatto nodes on each panel, from 4 to 64.
        panels: number of panels, up to 128; None for as many as the poles of the loop and the horizon need.
        tolerance: largest error relative to the peaks of positions and controls, in [1e-11, 1e-3].
        cross_check: share of a survey's rows that the contour solver computes too, in [0, 1].

    Raises:
        ArgumentError: an argument lies outside its range.
    """

    name = "volterra"

    def __init__(
        self, nodes: int = 32, panels: int | None = None, tolerance: float = 1e-8, cross_check: float = 0.0
    ) -> None:
        self.nodes = whole("nodes", nodes, _FEWEST_NODES, _MOST_NODES)
        self.panels = None if panels is None else whole("panels", panels, 1, _MOST_PANELS)
        if not 1e-11 <= tolerance <= 1e-3:
            raise ArgumentError("tolerance", tolerance, "must lie in [1e-11, 1e-3]")
        self.tolerance, self.cross_check = float(tolerance), share("cross_check", cross_check)

    def _refusal(self, system: LinearFractionalSystem) -> str | None:
        margin = order_margin(system)
        if 0.0 < margin < _LEAST_MARGIN:
            return (
                f"the volterra solver takes orders up to {2.0 - _LEAST_MARGIN} ({1.0 - _LEAST_MARGIN} of auxiliary"
                f" states), but one is {_LEAST_MARGIN - margin:g} above; use 'contour'"
            )
        return super()._refusal(system)

    def _solved(self, members: Members, rows: Array, radius: Floats, shift: Floats) -> Iterator[SolvedMembers]:
        """Solve `rows`; those that miss the tolerance again on more panels, the last time as they come out."""
        del shift
        cost = np.zeros(len(radius), dtype=np.int64)
        counts = self._first_counts(radius, members.horizon)
        hopeless = rows[counts[rows] > _MOST_PANELS]
        if hopeless.size:
            yield self._refused(members, hopeless)
        rows = rows[counts[rows] <= _MOST_PANELS]
        while rows.size:
            missed: list[Array] = []
            for group in self._chunks(members, rows, counts):
                panels = UniformPanels(members.horizon, int(counts[group[0]]), self.nodes)
                cost[group] += panels.count * self.nodes
                part = members.take(group)
                with np.errstate(over="ignore", invalid="ignore"):
                    response = respond(part, panels)
                good = response.error.max(axis=0) <= self.tolerance
                final = good if self.panels is None and 2 * panels.count <= _MOST_PANELS else np.ones_like(good)
                missed.append(group[~final])
                if final.any():
                    yield packed(part, response, np.flatnonzero(final), good, cost[group], panels.grid)
            rows = np.concatenate(missed)
            counts[rows] *= 2

    def _first_counts(self, radius: Floats, horizon: float) -> Array:
        if self.panels is not None:
            return np.full(len(radius), self.panels)
        wanted = np.ceil(radius * horizon / _reach(self.nodes))
        places = np.searchsorted(_PANEL_COUNTS, wanted)
        counts: Array = np.append(_PANEL_COUNTS, _MOST_PANELS + 1)[places]
        return counts

    def _refused(self, members: Members, rows: Array) -> SolvedMembers:
        if members.every:
            raise UnsupportedError(
                f"the volterra solver cannot resolve oscillations as fast as these up to {members.horizon:g};"
                " shorten the horizon, raise `nodes` or use 'contour'"
            )
        return without_trajectory(members.take(rows), "failed")

    def _chunks(self, members: Members, rows: Array, counts: Array) -> Iterator[Array]:
        size, k = members.system.size, len(members.y0)
        for count in np.unique(counts[rows]):
            group = rows[counts[rows] == count]
            entries = (size * self.nodes) ** 2 + 4 * k * size * self.nodes * (int(count) + 4)
            chunk = max(_LARGEST_CHUNK // entries, 1)
            for start in range(0, len(group), chunk):
                yield group[start : start + chunk]


def _reach(nodes: int) -> float:
    """Return the length of a panel times the pole radius that N nodes resolve."""
    return min(max(nodes - 8.0, 0.25 * nodes), _LONGEST)


def respond(members: Members, panels: UniformPanels) -> Values:
    """Solve with N and with 7/8 N nodes a panel, from y(0) and y'(0), each (k, b, p) or (k, 1, p)."""
    system = members.system
    shape = (len(members.y0), system.batch or 1, system.size)
    y0, rate = np.broadcast_to(members.y0, shape), np.broadcast_to(members.rate, shape)
    series = short_time_series(system, y0, rate, LARGEST_POWER)
    fine = Solution(system, series, panels)
    coarse = Solution(system, series, panels.coarser())
    response = values(system, fine.derivative, coarse.derivative, members.every)
    return replace(response, error=np.maximum(response.error, _rounding(series, panels, response)))


def _rounding(series: PowerSeries, panels: UniformPanels, response: Values) -> Floats:
    """Return the rounding of the powers over the peak of the positions, (k, b).

    On the last panel y is (S - h) P'(h) + P(h) plus what cancels most of it.
    """
    m = response.positions.shape[2]
    h, exponents = panels.length, np.asarray(series.exponents, dtype=np.float64)
    sizes = h**exponents * rgamma(exponents + 1.0) * (1.0 + exponents * (panels.count - 1))
    total = np.tensordot(sizes, np.abs(series.coefficients[:, :m]), axes=(0, 0)).max(axis=0)
    peak = np.abs(response.positions).max(axis=(2, 3))
    rounding: Floats = np.divide(_ROUNDING * total, peak, out=np.zeros_like(total), where=peak > 0.0)
    return rounding
