"""Populations that share what they know, on functions whose minima are known."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from fracctl.arrays import Floats
from fracctl.comparison.populations import OFFSPRING, adapt, evolve

TURN = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])


@dataclass
class Ellipsoids:
    """One for each target (m, n), a hundred times longer than wide, turned; every search looks at all points."""

    targets: Floats
    shared: bool = True
    asked: list[Floats] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.points, self.values = np.full_like(self.targets, 0.9), np.full(len(self.targets), np.inf)

    def of(self, points: Floats, target: Floats) -> Floats:
        turned = (points - target) @ TURN
        return np.asarray((turned**2) @ np.array([1.0, 1e4, 10.0]))

    def __call__(self, points: Floats) -> Floats:
        self.asked.append(points)
        for place, target in enumerate(self.targets):
            looked = points.reshape(-1, points.shape[2]) if self.shared else points[place]
            values = self.of(looked, target)
            if values.min() < self.values[place]:
                self.values[place], self.points[place] = values.min(), looked[np.argmin(values)]
        return np.stack([self.of(own, target) for own, target in zip(points, self.targets, strict=True)])


TARGETS = np.array([[0.3, 0.7, 0.5], [0.5, 0.2, 0.6], [0.45, 0.55, 0.9]])


def drawn(seed: int, count: int = 3) -> Floats:
    return np.random.default_rng(seed).random((count, 24, 3))


def test_populations_find_the_bottoms() -> None:
    known = Ellipsoids(TARGETS)
    spent = evolve(known, drawn(0), 24 * 120, np.random.default_rng(1))
    assert (spent, sum(points.shape[1] for points in known.asked)) == (24 * 120, 24 * 120)
    assert np.abs(known.points - TARGETS).max() < 1e-3


def test_cma_es_turns_with_a_valley() -> None:
    known = Ellipsoids(TARGETS)
    known(np.clip(TARGETS + 0.08, 0.0, 1.0)[:, None])
    spent = adapt(known, 1600, np.random.default_rng(2))
    assert spent == 1600
    assert known.values.max() < 1e-12, "valleys of 1 to 10 000 need covariances; round steps are at 1e-6 by then"


@pytest.mark.parametrize("search", ["evolve", "adapt"])
def test_an_optimum_beyond_an_edge_is_found_on_it(search: str) -> None:
    known = Ellipsoids(np.array([[1.4, 0.5, -0.3]]), shared=False)
    known(np.full((1, 1, 3), 0.6))
    if search == "evolve":
        evolve(known, drawn(3, 1), 24 * 200, np.random.default_rng(4))
    else:
        adapt(known, 200 * OFFSPRING, np.random.default_rng(4))
    assert all(points.min() >= 0.0 and points.max() <= 1.0 for points in known.asked)
    best = min(known.of(np.array([1.0, y, 0.0]), known.targets[0]) for y in np.linspace(0.0, 1.0, 100001))
    assert known.values[0] == pytest.approx(best, rel=1e-6)


def test_populations_take_what_others_have_found() -> None:
    """Two problems with one bottom: the population that begins beside it shows the other one where it is."""
    target = np.array([[0.3, 0.7, 0.5]] * 2)
    beside = target[0] + 1e-4 * (drawn(5, 1)[0] - 0.5)
    points = np.stack([drawn(6, 1)[0], beside])
    alone, together = Ellipsoids(target, shared=False), Ellipsoids(target)
    for known in (alone, together):
        evolve(known, points, 24 * 12, np.random.default_rng(7))
    assert together.values[0] < 1e-6 < alone.values[0]


def test_no_budget_spends_nothing() -> None:
    known = Ellipsoids(TARGETS)
    assert evolve(known, drawn(0), 23, np.random.default_rng(1)) == 0
    assert adapt(known, OFFSPRING - 1, np.random.default_rng(1)) == 0
    assert not known.asked
