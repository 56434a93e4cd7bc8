"""The pattern search, on closed-form functions and on the paper's problem."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.config.build import build_evaluation
from fracctl.config.compose import compose
from fracctl.surveys import PatternSearch
from fracctl.surveys.lqr_seed import LQRWeights, starting_point
from tests.surveys.bowls import Bowl

IN_PLANE = ["plant=hcw_in_plane", "controller=pd_alpha_in_plane", "objectives=in_plane", "objective=st_os"]


def search(steps: tuple[float, ...] = (0.1, 0.05), lower: float = -8.0, upper: float = 8.0) -> PatternSearch:
    return PatternSearch("one", "f", ("k", "h"), steps, lower, upper)


def starts(*points: tuple[float, float], alpha: float = 1.0) -> dict[str, np.ndarray]:
    k, h = np.array(points).T
    return {"alpha": np.full(len(points), alpha), "k": np.ascontiguousarray(k), "h": np.ascontiguousarray(h)}


def path(rows: dict[str, np.ndarray], point: int = 0) -> list[tuple[float, float]]:
    mine = rows["point"] == point
    return list(zip(rows["k"][mine].tolist(), rows["h"][mine].tolist(), strict=True))


def test_it_goes_down_a_bowl_by_the_best_neighbour() -> None:
    bowl = Bowl({"f": lambda alpha, k, h: 4.0 * (k - 0.25) ** 2 + (h + 0.1) ** 2})
    rows = search()(bowl, starts((0.0, 0.0)))
    assert path(rows) == [(0.0, 0.0), (0.1, 0.0), (0.2, 0.0), (0.2, -0.1), (0.25, -0.1)]
    assert rows["evaluations_spent"].tolist() == [1, 5, 8, 11, 17]
    assert rows["searched_for"].tolist() == ["f"] * 5
    assert rows["initial_condition"].tolist() == ["one"] * 5


def test_steps_do_not_drift() -> None:
    bowl = Bowl({"f": lambda alpha, k, h: np.abs(k + 3.7)})
    assert path(search((0.1,))(bowl, starts((0.0, 0.0))))[-1] == (-3.7, 0.0)


def test_it_stops_at_the_bounds() -> None:
    bowl = Bowl({"f": lambda alpha, k, h: -k - h})
    rows = search((0.5,), -1.0, 1.0)(bowl, starts((0.0, 0.0)))
    assert path(rows)[-1] == (1.0, 1.0)
    assert np.abs(bowl.points).max() <= 1.0


def test_an_equal_neighbour_is_no_improvement() -> None:
    flat = Bowl({"f": lambda alpha, k, h: np.zeros_like(k)})
    assert path(search()(flat, starts((0.0, 0.0)))) == [(0.0, 0.0)]


def test_ties_go_as_in_optima() -> None:
    bowl = Bowl({"f": lambda alpha, k, h: -np.abs(k) - np.abs(h)}, effort=lambda alpha, k, h: 1.0 + (k == 0.0))
    assert path(search((1.0,), -1.0, 1.0)(bowl, starts((0.0, 0.0))))[1] == (-1.0, 0.0)
    cheap = Bowl({"f": lambda alpha, k, h: -np.abs(k) - np.abs(h)}, effort=lambda alpha, k, h: 1.0 + (k != 0.0))
    assert path(search((1.0,), -1.0, 1.0)(cheap, starts((0.0, 0.0))))[1] == (0.0, -1.0)


@pytest.mark.parametrize(
    "fault",
    [
        {"unstable": lambda alpha, k, h: k > 0.15},
        {"effort": lambda alpha, k, h: np.where(k > 0.15, 0.0, 1.0)},
    ],
)
def test_what_is_no_optimum_is_no_improvement(fault: dict[str, object]) -> None:
    bowl = Bowl({"f": lambda alpha, k, h: (k - 0.3) ** 2}, **fault)  # type: ignore[arg-type]
    assert path(search()(bowl, starts((0.0, 0.0))))[-1] == (0.15, 0.0)


def test_it_finds_its_way_from_a_start_that_is_no_candidate() -> None:
    bowl = Bowl({"f": lambda alpha, k, h: k**2 + h**2}, unstable=lambda alpha, k, h: k > 0.95)
    assert path(search((0.1,))(bowl, starts((1.0, 0.0))))[-1] == (0.0, 0.0)
    nowhere = Bowl({"f": lambda alpha, k, h: k}, unstable=lambda alpha, k, h: np.ones(k.shape, dtype=bool))
    assert path(search()(nowhere, starts((1.0, 0.0)))) == [(1.0, 0.0)]


def test_searches_advance_together_as_they_would_alone() -> None:
    def function(alpha: np.ndarray, k: np.ndarray, h: np.ndarray) -> np.ndarray:
        return (k - 2.0 * alpha) ** 2 + (h - k) ** 2 + 0.1 * np.sin(20.0 * k) * np.cos(15.0 * h)

    points = [(0.0, 0.0), (1.0, -1.0), (0.3, 2.0), (0.0, 0.0)]
    together = Bowl({"f": function})
    rows = search()(together, starts(*points, alpha=0.9))
    assert rows["point"][:4].tolist() == [0, 1, 2, 3]
    assert list(zip(rows["k"][:4].tolist(), rows["h"][:4].tolist(), strict=True)) == points
    for number, point in enumerate(points):
        alone = Bowl({"f": function})
        single = search()(alone, starts(point, alpha=0.9))
        assert path(rows, number) == path(single)
        spent = rows["evaluations_spent"][rows["point"] == number]
        assert spent.tolist() == single["evaluations_spent"].tolist()
        assert len(alone.points) == len(np.unique(alone.points, axis=0))
    assert len(together.points) == len(np.unique(together.points, axis=0)), "no point is evaluated twice"


def test_only_its_initial_condition_is_evaluated() -> None:
    bowl = Bowl({"f": lambda alpha, k, h: k**2}, initial_conditions={"zero": 5.0, "one": 7.0})
    rows = search()(bowl, starts((1.0, 0.0)))
    assert set(rows["initial_condition"]) == {"one"}
    assert rows["objective_f"][-1] == 7.0


@pytest.mark.parametrize(
    ("name", "objective", "gains", "moves", "value"),
    [
        ("ic1", "st_os", [4.0, -1.35, 3.15, 0.4, 2.4, 0.65, 0.7, 1.95], (6, 2), 4.966),
        ("ic2", "st_os", None, None, 8.753),
        ("ic3", "st_os", None, None, 2.086),
        ("ic1", "st_u", None, None, 0.09497),
        ("ic3", "st_u", None, None, 0.2015),
    ],
)
def test_the_papers_pd_optima(
    name: str, objective: str, gains: list[float] | None, moves: tuple[int, int] | None, value: float
) -> None:
    """From the LQR seed; IC1's gains are printed in the paper, the values were measured by another program."""
    rows = in_plane_search(name, objective, "in_plane")
    assert rows[f"objective_{objective}"][-1] == pytest.approx(value, abs=0.6 * 10.0 ** -len(str(value).split(".")[1]))
    names = [n for n in rows if n.startswith("k_")]
    if gains is not None and moves is not None:
        assert [rows[n][-1] for n in names] == gains
        steps = [max(abs(np.diff(rows[n][i : i + 2])[0]) for n in names) for i in range(len(rows["point"]) - 1)]
        assert np.round(steps, 9).tolist() == [0.1] * moves[0] + [0.05] * moves[1]


@pytest.mark.parametrize(("name", "value"), [("ic1", 0.0949), ("ic3", 0.2013)])
def test_the_papers_values_come_from_samples(name: str, value: float) -> None:
    rows = in_plane_search(name, "st_u", "sampled")
    assert rows["objective_st_u"][-1] == pytest.approx(value, abs=5e-5)


def in_plane_search(name: str, objective: str, measures: str) -> dict[str, np.ndarray]:
    words = [*IN_PLANE, f"measures={measures}", "measures.overshoot.definition=largest_extremum"]
    evaluation = build_evaluation(compose([*words, f"initial_condition={name}"]))
    point = starting_point(evaluation, LQRWeights(round_to=0.05))
    gains = tuple(n for n in evaluation.design_variables if n.startswith("k_"))
    found = PatternSearch(name, objective, gains, (0.1, 0.05), -8.0, 8.0)
    return found(evaluation, {n: np.array([value]) for n, value in point.items()})
