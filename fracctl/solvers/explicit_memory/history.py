"""Fractional integrals on a step: exact for the polynomial of the step, by modes for all before it."""

from __future__ import annotations

import numpy as np
from scipy.special import ive

from fracctl.arrays import Floats
from fracctl.fractional.collocation import chebyshev_nodes, integral_matrix
from fracctl.fractional.sum_of_exponentials import sum_of_exponentials
from fracctl.solvers.explicit_memory.law import Signals

_LARGE = 1e4
"""Arguments of Bessel functions from which on their finite sums do not cancel."""


class History:
    """The integrals I^p s of a law's signals, for b members on steps with K Chebyshev-Gauss-Lobatto nodes.

    What lies before the step at t_n is kept in filters φ_j' = -s_j φ_j + s with the rates and weights of a sum of
    exponentials; a rate 0 serves p = 1. On the step, with c in [0, 1],

        I^p s(t_n + c h) = Σ_j w_j exp(-s_j c h) φ_j(t_n) + h^p (I^p P)(c),    P the polynomial through the nodes

    Args:
        signals: of the law.
        batch: b.
        nodes: K.
        shortest: shortest step.
        longest: horizon.
        tolerance: largest relative error of the kernel, at distances from that of the second node on.
    """

    def __init__(
        self, signals: Signals, batch: int, nodes: int, shortest: float, longest: float, tolerance: float
    ) -> None:
        self.signals = signals
        self.deep = np.flatnonzero(signals.orders.any(axis=1))
        """Which signals are integrals."""
        orders = signals.orders[self.deep]
        sources = signals.sources[self.deep]
        self.kept, self._which = np.unique(sources, return_inverse=True)
        distinct, which = np.unique(orders, return_inverse=True)
        which = which.reshape(orders.shape)
        local = np.array([integral_matrix(nodes, float(p)).T for p in distinct]).reshape(-1, nodes, nodes)
        shared = orders.shape[1] == 1
        self._local = local[which[:, 0]] if shared else local[which]
        self._orders = orders
        self._shared = shared
        inner = (distinct > 0.0) & (distinct < 1.0)
        self._nodes = chebyshev_nodes(nodes).t
        self._rates, weights = np.zeros(1), np.zeros((len(distinct), 1))
        weights[distinct == 1.0, 0] = 1.0
        if inner.any():
            kernel = sum_of_exponentials(distinct[inner], shortest * float(self._nodes[1]), longest, tolerance)
            self._rates = np.concatenate([self._rates, kernel.rates])
            weights = np.concatenate([weights, np.zeros((len(distinct), len(kernel.rates)))], axis=1)
            weights[inner, 1:] = kernel.weights
        self._weights = weights[which]
        self._modes = np.zeros((len(self.kept), batch, len(self._rates)))
        self._legendre = _legendre_coefficients(nodes)
        self._matrices: dict[float, tuple[Floats, Floats]] = {}

    def before(self, step: float) -> Floats:
        """Return what the steps so far add to the integrals at the nodes of the next, (F, b, K)."""
        decays, _ = self._of(step)
        earlier: Floats = (self._modes[self._which] * self._weights) @ decays
        return earlier

    def on_step(self, step: float, values: Floats) -> Floats:
        """Return what values at the nodes of the step in progress, (S, b, K), add to them, (F, b, K)."""
        inner = values[self.signals.sources[self.deep]]
        scale = step ** self._orders[..., None]
        if self._shared:
            shared: Floats = (inner @ self._local) * scale
            return shared
        own: Floats = (inner[:, :, None] @ self._local)[:, :, 0] * scale
        return own

    def keep(self, step: float, values: Floats) -> None:
        """Take a finished step into account."""
        decays, update = self._of(step)
        self._modes = self._modes * decays[:, -1] + values[self.kept] @ update

    def _of(self, step: float) -> tuple[Floats, Floats]:
        """Return exp(-s_j c_i h), (J, K), and the matrix of h ∫_0^1 exp(-s_j h (1-u)) P(u) du, (K, J).

        The integrals of Legendre polynomials are exp(-a) i_n(a), a = s_j h/2, with modified spherical Bessel functions.
        """
        if step not in self._matrices:
            decays = np.exp(-np.multiply.outer(self._rates * step, self._nodes))
            moments = np.zeros((len(self._rates), len(self._nodes)))
            moments[0, 0] = 1.0
            moments[1:] = _bessel(len(self._nodes), 0.5 * step * self._rates[1:])
            self._matrices[step] = decays, step * (moments @ self._legendre).T
        return self._matrices[step]


def _bessel(count: int, a: Floats) -> Floats:
    """Return exp(-a) i_n(a) for n < count, (J, count), with a > 0, (J,).

    2a exp(-a) i_n(a) = Σ_k (-1)^k (n+k)!/(k! (n-k)! (2a)^k), but for exp(-2a); large arguments overflow SciPy's.
    """
    n, large = np.arange(count), a > _LARGE
    out = np.empty((len(a), count))
    out[~large] = np.sqrt(0.5 * np.pi / a[~large, None]) * ive(n + 0.5, a[~large, None])
    term = np.repeat(0.5 / a[large, None], count, axis=1)
    out[large] = term
    for k in range(count - 1):
        term = -term * (n + k + 1) * (n - k) / ((k + 1) * 2.0 * a[large, None])
        out[large] += term
    return out


def _legendre_coefficients(nodes: int) -> Floats:
    """Return the matrix (K, K) from values at the nodes of [0, 1] to coefficients of Legendre polynomials."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    degrees = np.arange(nodes)
    legendre = np.polynomial.legendre.legvander(x, nodes - 1)
    basis = chebyshev_nodes(nodes).interpolation(0.5 * (x + 1.0))
    coefficients: Floats = ((degrees + 0.5)[:, None] * legendre.T * w) @ basis
    return coefficients
