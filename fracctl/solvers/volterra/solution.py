"""The equations of second kind for the highest derivatives of a batch of loops, panel by panel."""

from __future__ import annotations

import numpy as np
from scipy.special import betainc, rgamma

from fracctl.arrays import Floats
from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.fractional.series import PowerSeries
from fracctl.fractional.system import LinearFractionalSystem
from fracctl.solvers.blocks import Term, assembled, solve_each, terms_of
from fracctl.solvers.volterra.panels import UniformPanels

_SAME = 1e-12
"""Orders that differ by less are one order, rounded differently."""


class Solution:
    """y = P + I^ℓ g on the first panel, P powers of time; D^ℓ y = g on the others.

    In the first panel Σ A I^(ℓ-β) g = -Σ A D^β P. In a later one the right-hand side is what y(0) + y'(0) t, the
    powers on the first panel and g on all panels before it add to the D^β y.

    Args:
        system: loops that share their orders.
        series: P, from k initial states, with the powers 1 and t among them.
        panels: where g is known by its values.
    """

    def __init__(self, system: LinearFractionalSystem, series: PowerSeries, panels: UniformPanels) -> None:
        self.system, self.series, self.panels = system, series, panels
        matrix = CharacteristicMatrix(system)
        self.terms = list(terms_of(matrix))
        self.exponents = np.asarray(series.exponents, dtype=np.float64)
        self.highest = np.zeros((*series.coefficients.shape[2:], system.size, panels.count, panels.nodes))
        """g, (k, b, p, count, N)."""
        self._later: dict[tuple[int, float], Floats] = {}
        for block in matrix.blocks():
            self._solve(block)

    def derivative(self, component: int, order: float) -> Floats:
        """Return D^order of a coordinate at the sampling times, (k, b, T)."""
        order = next((t.order for t in self.terms if abs(t.order - order) < _SAME), order)
        panels, g = self.panels, self.highest[:, :, component]
        integral = self._integral(component, order)
        first = self._powers(component, order, panels.start) + panels.on_start(integral, g[:, :, 0])
        if panels.count == 1:
            return first
        later = self._later_powers(component, order).copy()
        local = g[:, :, 1:] @ panels.local(integral).T
        for q in range(1, panels.count):
            later[:, :, q - 1] += local[:, :, q - 1] + panels.memory(integral, g[:, :, :q])
        return np.concatenate([first, panels.resampled(later)], axis=-1)

    def _integral(self, component: int, order: float) -> float:
        """Return the order of the integral of g that D^order of a coordinate is."""
        return float(self.system.highest[component]) - order

    def _solve(self, block: list[int]) -> None:
        """Fill in g of coordinates that are coupled to each other only."""
        terms = [term for term in self.terms if term.row in block]
        later = {(t.column, t.order): self._later_powers(t.column, t.order) for t in terms}
        inverse = self._inverse(terms, block)
        k, b = self.highest.shape[:2]
        for panel in range(self.panels.count):
            known = {key: self._known(*key, panel, powers) for key, powers in later.items()}
            right = np.zeros((k, b, len(block), self.panels.nodes))
            for term in terms:
                gain = np.broadcast_to(term.coefficient, b)[:, None]
                right[:, :, block.index(term.row)] -= gain * known[term.column, term.order]
            solution = np.einsum("bij,kbj->kbi", inverse, right.reshape(k, b, -1))
            self.highest[:, :, block, panel] = solution.reshape(right.shape)

    def _known(self, component: int, order: float, panel: int, powers: Floats) -> Floats:
        """Return D^order of a coordinate at the nodes of a panel without the part of g on that panel, (k, b, N)."""
        if panel == 0:
            return self._powers(component, order, self.panels.first_times)
        before = self.highest[:, :, component, :panel]
        added: Floats = powers[:, :, panel - 1] + self.panels.memory(self._integral(component, order), before)
        return added

    def _inverse(self, terms: list[Term], block: list[int]) -> Floats:
        """Return the inverse of Σ A I^(ℓ-β) on one panel, (b, P N, P N)."""

        def operator(term: Term) -> Floats:
            return self.panels.local(self._integral(term.column, term.order))

        matrix = assembled(terms, block, self.system.batch or 1, self.panels.nodes, operator)
        return solve_each(matrix, np.broadcast_to(np.eye(matrix.shape[-1]), matrix.shape))

    def _later_powers(self, component: int, order: float) -> Floats:
        """Return what P on the first panel adds to D^order of a coordinate at the nodes of the others, (k, b, q, N)."""
        if (component, order) not in self._later:
            times = self.panels.later_times
            powers = self._powers(component, order, times.ravel(), later=True)
            self._later[component, order] = powers.reshape(*powers.shape[:2], *times.shape)
        return self._later[component, order]

    def _powers(self, component: int, order: float, times: Floats, later: bool = False) -> Floats:
        """Return what P on the first panel adds to D^order of a coordinate at times on it or `later`, (k, b, t).

        1/Γ(μ) ∫₀ʰ (t-τ)^(μ-1) τ^(a-1)/Γ(a) dτ = t^(a+μ-1)/Γ(a+μ) B(h/t; a, μ) with the regularised incomplete beta
        function B; y(0) + y'(0) t counts in full.
        """
        coefficients = self.series.coefficients[:, component]
        killed = (self.exponents < order) & (self.exponents == np.floor(self.exponents))
        used = np.flatnonzero(np.any(coefficients, axis=(1, 2)) & ~killed)
        _, first, which = np.unique(self.exponents[used].round(9), return_index=True, return_inverse=True)
        exponents = self.exponents[used][first]
        merged = np.zeros((len(exponents), *coefficients.shape[1:]))
        np.add.at(merged, which, coefficients[used])
        basis = times ** (exponents[:, None] - order) * rgamma(exponents[:, None] - order + 1.0)
        if later:
            start, integral = float(self.system.highest[component]) - 1.0, self._integral(component, order)
            inner = exponents > start
            share = self.panels.length / times
            basis[inner] *= _share_of_power(exponents[inner, None] - start, integral, share)
        return np.tensordot(merged, basis, axes=(0, 0))


def _share_of_power(a: Floats, order: float, share: Floats) -> Floats:
    """Return B(x; a, μ), which is elementary for the orders μ of integer derivatives."""
    if order not in (0.0, 1.0, 2.0):
        return np.asarray(betainc(a, order, share), dtype=np.float64)
    elementary = (0.0, 1.0, 1.0 + a * (1.0 - share))[int(order)]
    return np.asarray(share**a * elementary, dtype=np.float64)
