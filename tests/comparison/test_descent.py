"""The pattern search on functions whose minima are known."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.comparison.descent import descend, neighbours

BOX = (np.zeros((1, 2)), np.ones((1, 2)))


def bowl(points: Floats) -> Floats:
    return np.asarray(np.sum((points - [0.3, 0.7]) ** 2, axis=-1))


def test_it_finds_the_bottom_of_a_bowl() -> None:
    start = np.array([[0.9, 0.1]])
    found = descend(bowl, start, bowl(start[:, None])[:, 0], BOX, 100 * neighbours(2), (1,))
    assert np.abs(found.points - [0.3, 0.7]).max() < 1e-6
    assert found.values == bowl(found.points[:, None])[:, 0]
    assert found.evaluations == 100 * neighbours(2)


def test_it_follows_an_oblique_cliff() -> None:
    def cliff(points: Floats) -> Floats:
        x, y = points[..., 0], points[..., 1]
        return np.where(y > x + 0.05, np.inf, 1.0 - x + 0.2 * np.abs(y - x))

    start = np.array([[0.1, 0.14]])
    found = descend(cliff, start, cliff(start[:, None])[:, 0], BOX, 200 * neighbours(2), (2,))
    assert np.abs(found.points - 1.0).max() < 1e-3


def test_it_stays_in_the_box() -> None:
    start = np.array([[0.5, 0.5]])
    found = descend(lambda p: -p.sum(axis=-1), start, np.array([-1.0]), BOX, 60 * neighbours(2), (3,))
    assert found.points.tolist() == [[1.0, 1.0]]


def test_a_problem_takes_what_another_finds() -> None:
    targets = np.array([[0.2, 0.2], [0.8, 0.8]])

    def shared(points: Floats) -> Floats:
        return np.stack([np.sum((points.reshape(-1, 2) - target) ** 2, axis=1) for target in targets])

    start = np.array([[0.81, 0.8], [0.2, 0.21]])
    values = np.sum((start - targets) ** 2, axis=1)
    box = (np.zeros((2, 2)), np.ones((2, 2)))
    found = descend(shared, start, values, box, neighbours(2), (4,), first_step=1e-3)
    assert np.abs(found.points - targets).max() < 0.02, "one round is enough, for the other's neighbours are there"


def test_no_budget_leaves_the_start() -> None:
    start = np.array([[0.9, 0.1]])
    found = descend(bowl, start, np.array([0.72]), BOX, neighbours(2) - 1, (1,))
    assert (found.points.tolist(), found.evaluations) == ([[0.9, 0.1]], 0)
