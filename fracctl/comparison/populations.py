"""Populations for many related problems at a time, which share all points they look at.

Hundreds of them advance together, a generation in one call: a solver is fastest with thousands of points at a time, and
so are the few array operations that a generation takes here.

The algorithms of `fracctl.surveys.search_algorithms` are a library's, an object for each search, and serve the few
searches of `survey: search` (NSGA-II too). Here they would take most of the time: a generation of 72 searches of 64
points costs them 0.2 s by differential evolution, these lines 0.5 ms and the solver 20 ms. And they cannot take a point
that another search has found, which is what makes the comparison one of laws.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fracctl.arrays import Floats

_WEIGHT, _CROSSOVER = 0.7, 0.9
"""Of differential evolution."""
_EXCHANGED = 4
"""Generations after which populations take what others have found for them."""
OFFSPRING = 16
"""Points of a generation of CMA-ES."""
_FIRST_STEP = 0.05
"""Its first standard deviation, of the width of the box."""
_STEPS = (1e-9, 1.0)
_LEAST_VARIANCE = 1e-20


class Shared(Protocol):
    """What m searches minimise, each over the unit box; knows the best point for each, whoever looked at it."""

    @property
    def points(self) -> Floats:
        """The best points known, (m, n)."""
        ...

    @property
    def values(self) -> Floats:
        """Their values, (m,)."""
        ...

    def __call__(self, points: Floats) -> Floats:
        """Return what search i has at its points (m, p, n), (m, p), and learn of them."""
        ...


def evolve(shared: Shared, points: Floats, evaluations: int, random: np.random.Generator) -> int:
    """Let m populations (m, p, n) go on by differential evolution; return the evaluations that each has spent.

    DE/best/1/bin. Every fourth generation the best point that is known for a population takes the place of its worst
    one, where it is better than all of it.

    Source: R. Storn, K. Price, Differential evolution, J. Global Optim. 11 (1997) 341.
    """
    count, size, n = points.shape
    everyone = np.arange(count)
    generations = evaluations // size
    if not generations:
        return 0
    values = shared(points)
    for generation in range(1, generations):
        best = points[everyone, np.argmin(values, axis=1)][:, None]
        one, other = random.integers(size, size=(2, count, size))
        moved = best + _WEIGHT * (points[everyone[:, None], one] - points[everyone[:, None], other])
        taken = random.random((count, size, n)) < _CROSSOVER
        taken |= np.arange(n) == random.integers(n, size=(count, size, 1))
        tried = np.where(taken, _inside(moved, best, random), points)
        found = shared(tried)
        better = found <= values
        points, values = np.where(better[..., None], tried, points), np.where(better, found, values)
        if generation % _EXCHANGED == 0:
            (behind,) = np.nonzero(shared.values < values.min(axis=1))
            worst = np.argmax(values[behind], axis=1)
            points[behind, worst], values[behind, worst] = shared.points[behind], shared.values[behind]
    return int(generations * size)


def _inside(moved: Floats, base: Floats, random: np.random.Generator) -> Floats:
    """Return points with every coordinate beyond an edge put anywhere between that edge and the base."""
    share = random.random(moved.shape)
    moved = np.where(moved < 0.0, base * share, moved)
    return np.where(moved > 1.0, 1.0 - (1.0 - base) * share, moved)


def adapt(shared: Shared, evaluations: int, random: np.random.Generator) -> int:
    """Go on from the best points that are known by CMA-ES; return the evaluations that each search has spent.

    Points beyond an edge are put on it, and count as if they had been drawn there: many optima lie on edges.

    Source: N. Hansen, The CMA evolution strategy: a tutorial, arXiv:1604.00772, with its default parameters.
    """
    strategies = _Strategies.default(shared.points)
    generations = evaluations // OFFSPRING
    for _ in range(generations):
        points = strategies.ask(random)
        strategies.tell(points, shared(points))
    return generations * OFFSPRING


@dataclass
class _Strategies:
    """The states of m strategies in n dimensions."""

    means: Floats
    steps: Floats
    covariances: Floats
    paths: Floats
    step_paths: Floats
    weights: Floats
    generation: int = 0

    @classmethod
    def default(cls, means: Floats) -> _Strategies:
        count, n = means.shape
        kept = OFFSPRING // 2
        weights = np.log(kept + 0.5) - np.log(np.arange(1, kept + 1))
        spheres = np.tile(np.eye(n), (count, 1, 1))
        still = np.zeros((count, n))
        return cls(means, np.full(count, _FIRST_STEP), spheres, still, still, weights / weights.sum())

    def ask(self, random: np.random.Generator) -> Floats:
        """Return points of all, (m, p, n)."""
        variances, self._axes = np.linalg.eigh(self.covariances)
        self._lengths = np.sqrt(np.maximum(variances, _LEAST_VARIANCE))
        drawn = random.standard_normal((len(self.means), OFFSPRING, self.means.shape[1])) * self._lengths[:, None]
        moves = drawn @ self._axes.transpose(0, 2, 1)
        points: Floats = np.clip(self.means[:, None] + self.steps[:, None, None] * moves, 0.0, 1.0)
        return points

    def tell(self, points: Floats, values: Floats) -> None:
        """Move means, steps and covariances after the better half of the points."""
        self.generation += 1
        order = np.argsort(values, axis=1, kind="stable")[:, : len(self.weights), None]
        moves = (np.take_along_axis(points, order, axis=1) - self.means[:, None]) / self.steps[:, None, None]
        move = np.einsum("k,mki->mi", self.weights, moves)
        self.means = self.means + self.steps[:, None] * move
        straight = self._turn_step_paths(move)
        self._spread(moves, move, straight)

    def _turn_step_paths(self, move: Floats) -> Floats:
        """Lengthen or shorten the steps; return 1 where the path is short enough to count, 0 elsewhere, (m,)."""
        n, mass = move.shape[1], 1.0 / float(self.weights @ self.weights)
        rate = (mass + 2.0) / (n + mass + 5.0)
        damping = 1.0 + 2.0 * max(0.0, float(np.sqrt((mass - 1.0) / (n + 1.0))) - 1.0) + rate
        white = np.einsum("mij,mj->mi", self._axes, np.einsum("mij,mi->mj", self._axes, move) / self._lengths)
        self.step_paths = (1.0 - rate) * self.step_paths + np.sqrt(rate * (2.0 - rate) * mass) * white
        expected = np.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))
        length = np.linalg.norm(self.step_paths, axis=1) / expected
        settled = length / np.sqrt(1.0 - (1.0 - rate) ** (2 * self.generation))
        self.steps = np.clip(self.steps * np.exp(np.minimum((length - 1.0) * rate / damping, 1.0)), *_STEPS)
        return np.where(settled < 1.4 + 2.0 / (n + 1.0), 1.0, 0.0)

    def _spread(self, moves: Floats, move: Floats, straight: Floats) -> None:
        """Turn and stretch the covariances."""
        n, mass = move.shape[1], 1.0 / float(self.weights @ self.weights)
        rate = (4.0 + mass / n) / (n + 4.0 + 2.0 * mass / n)
        one = 2.0 / ((n + 1.3) ** 2 + mass)
        kept = min(1.0 - one, 2.0 * (mass - 2.0 + 1.0 / mass) / ((n + 2.0) ** 2 + mass))
        pushed = straight[:, None] * np.sqrt(rate * (2.0 - rate) * mass) * move
        self.paths = (1.0 - rate) * self.paths + pushed
        held = 1.0 - one - kept + one * (1.0 - straight) * rate * (2.0 - rate)
        self.covariances = held[:, None, None] * self.covariances
        self.covariances += one * np.einsum("mi,mj->mij", self.paths, self.paths)
        self.covariances += kept * np.einsum("k,mki,mkj->mij", self.weights, moves, moves)
