"""Continuation over orders: which searches run, in which blocks, and what they find."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.surveys import Continuation, Optima, PatternSearchSurvey, Survey
from fracctl.surveys.continuation import _fronts
from tests.surveys.bowls import Bowl, run

OPTIONS: dict[str, Any] = {
    "axes": {"alpha": "0.8:1.0:0.05"},
    "start": {"alpha": 1.0},
    "first_steps": [0.1, 0.05],
    "steps": [0.05],
    "bounds": [-8.0, 8.0],
}


def valley(alpha: np.ndarray, k: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Lowest at k = 2α, h = 1 - α, where it is α."""
    return alpha + (k - 2.0 * alpha) ** 2 + (h - 1.0 + alpha) ** 2


def bowl(**options: Any) -> Bowl:
    functions = {"f": valley, "g": lambda alpha, k, h: 2.0 - valley(alpha, k, h) * 0.0 + np.abs(k - 1.0)}
    return Bowl(functions, **options)


def survey(evaluation: Any, **changes: Any) -> Survey:
    return Continuation(evaluation, 0, **(OPTIONS | changes))


def test_every_order_gets_its_best_gains() -> None:
    evaluation = bowl(initial_conditions={"one": 0.0, "two": 10.0})
    under_test = survey(evaluation)
    blocks = run(under_test, evaluation)
    optima = Optima(evaluation.objectives, evaluation.design_variables, under_test.slices, under_test.baseline)
    for number in sorted(blocks):
        optima.add(blocks[number])
    found = [row for row in optima.rows() if row["objective_name"] == "f" and row["initial_condition"] == "two"]
    slices = [(row["alpha"], row["k"], row["h"]) for row in found if row["kind"] == "slice"]
    np.testing.assert_allclose(slices, [(a, 2 * a, 1 - a) for a in (0.8, 0.85, 0.9, 0.95, 1.0)], atol=1e-9)
    assert {row["alpha"] for row in found if row["kind"] == "baseline"} == {1.0}
    assert [row["objective_f"] for row in found if row["kind"] == "overall"] == pytest.approx([10.8])


def test_blocks_are_numbered_whatever_the_order_of_answers() -> None:
    evaluation = bowl(initial_conditions={"one": 0.0, "two": 10.0})
    one, other = survey(evaluation), survey(evaluation)
    backwards = run(one, evaluation)
    forwards: dict[int, dict[str, np.ndarray]] = {}
    waiting: list[Any] = []
    while not other.finished:
        waiting += other.ask()
        block = waiting.pop(0)
        rows = block.search(evaluation, block.design)
        rows["point"] = block.first_point + rows["point"]
        forwards[block.number] = rows
        other.tell(block.number, rows)
    assert sorted(forwards) == sorted(backwards) == list(range(2 * 2 * 5))
    for number, rows in forwards.items():
        for name, values in rows.items():
            np.testing.assert_array_equal(values, backwards[number][name])
    points = np.concatenate([forwards[number]["point"] for number in sorted(forwards)])
    assert sorted(set(points.tolist())) == list(range(one.n_points or 0))


def test_tracks_do_not_wait_for_each_other() -> None:
    evaluation = bowl(initial_conditions={"one": 0.0, "two": 10.0})
    under_test = survey(evaluation)
    first = under_test.ask()
    assert [block.number for block in first] == [0, 5, 10, 15]
    assert [(block.search.initial_condition, block.search.objective) for block in first] == [
        ("one", "f"), ("two", "f"), ("one", "g"), ("two", "g")
    ]  # fmt: skip
    assert under_test.ask() == []
    rows = first[1].search(evaluation, first[1].design)
    rows["point"] = first[1].first_point + rows["point"]
    under_test.tell(5, rows)
    assert [block.number for block in under_test.ask()] == [6]


def test_fronts_go_outward_from_any_start() -> None:
    axes = {"a": np.arange(4.0), "b": np.arange(3.0)}
    fronts = _fronts([2, 0], axes)
    assert fronts[0] == [((2, 0), (2, 0))]
    assert fronts[1] == [((1, 0), (2, 0)), ((2, 1), (2, 0)), ((3, 0), (2, 0))]
    places = {place for front in fronts for place, _ in front}
    assert places == set(itertools.product(range(4), range(3)))
    for number, front in enumerate(fronts):
        for place, neighbour in front[number == 0 :]:
            assert abs(place[0] - 2) + place[1] == number
            assert abs(neighbour[0] - 2) + neighbour[1] == number - 1
            assert sum(abs(i - j) for i, j in zip(place, neighbour, strict=True)) == 1


def test_a_search_starts_from_every_neighbour_and_the_best_is_kept() -> None:
    """Two valleys: the one that α leaves is the better one further out, and only one path leads there."""

    def two(alpha: np.ndarray, k: np.ndarray, h: np.ndarray) -> np.ndarray:
        return np.minimum(np.abs(k - 1.0) + 1.0, np.abs(k + 1.0) + 10.0 * (alpha - 0.8))

    evaluation = Bowl({"f": two}, parameters={"k": -0.6, "h": 0.0})
    blocks = run(survey(evaluation), evaluation)
    last = blocks[4]
    assert last["k"][-1] == pytest.approx(-1.0)
    assert last["objective_f"][-1] == pytest.approx(0.0, abs=1e-9)


def test_a_failed_front_does_not_stop_the_others() -> None:
    evaluation = bowl()
    blocks = run(survey(evaluation, objectives=["f"]), evaluation, fails=(2,))
    assert sorted(blocks) == [0, 1, 2, 3, 4]
    starts = blocks[3]["k"][0], blocks[3]["h"][0]
    assert starts == (blocks[1]["k"][-1], blocks[1]["h"][-1]), "the next front starts from the last good one"
    assert blocks[4]["k"][-1] == pytest.approx(1.6)


def test_a_pattern_search_is_one_search_for_each() -> None:
    evaluation = bowl(initial_conditions={"one": 0.0, "two": 10.0}, parameters={"k": 1.0, "h": 0.5, "alpha": 0.9})
    under_test = PatternSearchSurvey(evaluation, 0, [0.1], [-8.0, 8.0], objectives=["f"])
    assert (under_test.n_points, under_test.slices, under_test.baseline) == (2, (), {})
    blocks = run(under_test, evaluation)
    for rows in blocks.values():
        assert (rows["alpha"][0], rows["k"][0], rows["h"][0]) == (0.9, 1.0, 0.5)
        assert (rows["alpha"][-1], rows["k"][-1], rows["h"][-1]) == pytest.approx((0.9, 1.8, 0.1))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"axes": {"k": "0:1:0.5"}}, r"`axes.k` must name a parameter that is no gain \(alpha\)"),
        ({"axes": {"alpha": "0.8:1.2:0.1"}}, r"`axes.alpha` must lie in \(0, 1\], but holds 1.1"),
        ({"axes": {"alpha": "0.8:1.0:0.15"}}, "`axes.alpha` must reach stop in whole steps"),
        ({"axes": {"alpha": "0.00001:1.0:0.00001"}}, "`axes` must make at most 10000 points, but make 100000"),
        ({"start": {"alpha": 0.97}}, "`start.alpha` must be one of the values of its axis, but is 0.97"),
        ({"start": {}}, "`start` must hold a value of alpha, for it is an axis"),
        ({"start": {"alpha": 1.0, "k": 0.0}}, r"`start.k` must name an axis \(alpha\)"),
        ({"steps": []}, "`steps` must hold at least one step, all of them positive"),
        ({"first_steps": [0.1, -0.1]}, "`first_steps` must hold at least one step, all of them positive"),
        ({"bounds": [8.0, -8.0]}, "`bounds` must hold the least and the largest gain"),
        ({"bounds": [1.0, 8.0]}, "`bounds` must hold the gains of the start, but not k = 0"),
        ({"objectives": ["h"]}, r"`objectives` must name objectives of the run \(f, g\)"),
        ({"objectives": []}, "`objectives` must name at least one objective"),
    ],
)
def test_what_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        survey(bowl(), **changes)


def test_a_law_without_gains_cannot_be_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Bowl.law, "parameters", staticmethod(lambda components: ()))
    with pytest.raises(ConfigurationError, match="varies gains, but the controller has none"):
        survey(bowl())
