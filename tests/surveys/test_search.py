"""Stochastic searches on functions with a known minimum or a known front: budget, seeds, limits, names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from fracctl.controllers import Parameter
from fracctl.errors import ArgumentError
from fracctl.evaluation import BEYOND_LIMITS
from fracctl.measures import Measure
from fracctl.measures.limits import Limit, excess, limit
from fracctl.plants import LinearPlant
from fracctl.surveys import Block, PopulationSearch
from fracctl.surveys.search_algorithms import ALGORITHMS

BOUNDS = {"gains": [-4.0, 4.0], "orders": [0.5, 1.0]}


class Law:
    @staticmethod
    def parameters(components: Sequence[str]) -> tuple[Parameter, ...]:
        return (Parameter("alpha", 1.0, 0.0, 1.0, lower_allowed=False, kind="order"), Parameter("p"), Parameter("q"))


class Column:
    """A measure of nothing, that names a column."""

    def __init__(self, name: str) -> None:
        self.name, self.columns = name, (name,)


@dataclass(frozen=True)
class Bowls:
    """Two bowls over the gains, time = 1 + (p - 1)² + (q - 2)² + 10 (alpha - 0.7)² and size = 1 + (p + 1)² + (q - 2)².

    Points with q < -1 are unstable, those with p < -3 do not settle.
    """

    initial_conditions: Mapping[str, Any] = field(default_factory=lambda: {"one": np.ones(2), "two": np.ones(2)})
    measures: tuple[Measure, ...] = (Column("time"), Column("size"))  # type: ignore[assignment]
    measured_columns = ("time", "size")
    constraints: Mapping[str, Limit] = field(default_factory=dict)
    objectives: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: {"t": ("time",), "s": ("size",)})
    objective: str = "t"
    parameters: Mapping[str, float] = field(default_factory=lambda: {"alpha": 1.0, "p": 0.0, "q": 0.0})
    plant: LinearPlant = field(default_factory=lambda: LinearPlant(-1.0, components=("w",)))
    law: type[Law] = Law
    calls: list[int] = field(default_factory=list)
    row_columns = (
        "initial_condition",
        "alpha",
        "p",
        "q",
        "time",
        "size",
        "objective_t",
        "objective_s",
        "status",
        "stable",
    )

    def __call__(self, design: Mapping[str, np.ndarray]) -> dict[str, Any]:
        (condition,) = self.initial_conditions
        alpha, p, q = design["alpha"], design["p"], design["q"]
        self.calls.append(len(p))
        unstable, unsettled = q < -1.0, p < -3.0
        time = np.where(unstable | unsettled, np.inf, 1.0 + (p - 1.0) ** 2 + (q - 2.0) ** 2 + 10.0 * (alpha - 0.7) ** 2)
        size = np.where(unstable, np.inf, 1.0 + (p + 1.0) ** 2 + (q - 2.0) ** 2)
        beyond = excess({"time": time, "size": size}, self.constraints) > 0.0
        words = ["unstable", "unsettled", BEYOND_LIMITS]
        status = np.select([unstable, unsettled, beyond], words, "ok").astype(object)
        rows = {
            "initial_condition": np.full(len(p), condition, dtype=object),
            **design,
            "time": time,
            "size": size,
            "objective_t": time,
            "objective_s": size,
            "status": status,
            "stable": np.where(unstable, False, True).astype(object),
        }
        return rows | {"final_distance": np.where(unstable, np.inf, -p)} if len(self.measures) == 3 else rows


def survey(evaluation: Bowls | None = None, seed: int = 0, **options: Any) -> PopulationSearch:
    given = {"bounds": BOUNDS, "evaluations": 3000, "starts": 2, "population": 24} | options
    return PopulationSearch(evaluation or Bowls(), seed, **given)  # type: ignore[arg-type]


def run(block: Block, evaluation: Bowls | None = None) -> dict[str, Any]:
    assert block.search is not None
    return block.search(evaluation or Bowls(), block.design)  # type: ignore[arg-type]


@pytest.mark.parametrize("algorithm", ["differential_evolution", "cma_es"])
def test_the_minimum_is_found_over_gains_and_orders(algorithm: str) -> None:
    block = survey(algorithm=algorithm).ask()[0]
    rows = run(block)
    for start in range(2):
        last = np.flatnonzero(rows["point"] == start)[-1]
        found = [rows[name][last] for name in ("alpha", "p", "q", "time")]
        np.testing.assert_allclose(found, [0.7, 1.0, 2.0, 1.0], atol=2e-3)


def test_the_front_is_the_segment_between_the_two_minima() -> None:
    """With alpha at 0.7, neither time nor size can be improved without the other for -1 ≤ p ≤ 1, q = 2."""
    rows = run(survey(algorithm="nsga2", evaluations=6000, starts=1, population=60).ask()[0])
    front = {name: values[1:] for name, values in rows.items()}
    assert front["searched_for"].tolist() == [None] * len(front["p"])
    assert len(front["p"]) > 30
    np.testing.assert_allclose(front["q"], 2.0, atol=0.15)
    np.testing.assert_allclose(front["alpha"], 0.7, atol=0.15)
    assert front["p"].min() == pytest.approx(-1.0, abs=0.1)
    assert front["p"].max() == pytest.approx(1.0, abs=0.1)
    better = (front["time"][:, None] < front["time"]) & (front["size"][:, None] < front["size"])
    assert not better.any()


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_the_budget_is_kept_exactly(algorithm: str) -> None:
    evaluation = Bowls()
    block = survey(algorithm=algorithm, evaluations=1003, starts=2).ask()[0]
    rows = run(block, evaluation)
    assert sum(evaluation.calls) == 2 * 1003
    assert max(evaluation.calls) == 2 * 24
    assert rows["evaluations_spent"].min() == 1
    assert rows["evaluations_spent"].max() <= 1003


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_one_seed_one_result_and_the_global_generator_is_left_alone(algorithm: str) -> None:
    np.random.seed(1)  # noqa: NPY002 - CMA-ES would set it
    state = np.random.get_state()[1].tolist()  # type: ignore[index,union-attr]  # noqa: NPY002
    first, second = (run(survey(algorithm=algorithm, evaluations=1500).ask()[0]) for _ in range(2))
    assert np.random.get_state()[1].tolist() == state  # type: ignore[index,union-attr]  # noqa: NPY002
    assert all(first[name].tolist() == second[name].tolist() for name in first)
    other = run(survey(algorithm=algorithm, evaluations=1500, seed=1).ask()[0])
    assert first["p"].tolist() != other["p"].tolist()


def test_the_path_begins_with_the_starts_and_then_improves() -> None:
    block = survey(starts=3).ask()[0]
    rows = run(block)
    assert all(rows[name][:3].tobytes() == values.tobytes() for name, values in block.design.items())
    assert rows["point"][:3].tolist() == [0, 1, 2]
    for start in range(3):
        mine = np.flatnonzero(rows["point"] == start)[1:]
        assert np.all(np.diff(rows["time"][mine]) < 0.0)
        assert np.all(np.diff(rows["evaluations_spent"][mine]) > 0)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_limits_are_kept(algorithm: str) -> None:
    """The best time with size ≤ 2 lies on the line between the minima, at p = 0."""
    evaluation = Bowls(constraints={"size": limit("<= 2")})
    rows = run(survey(evaluation, algorithm=algorithm, evaluations=6000).ask()[0], evaluation)
    sound = rows["status"] == "ok"
    assert set(rows["status"][2:]) == {"ok"}
    assert set(rows["status"][:2]) <= {"ok", "unstable", "unsettled", BEYOND_LIMITS}
    assert rows["size"][sound].max() <= 2.0
    assert rows["time"][sound].min() == pytest.approx(2.0, rel=0.02)


def test_it_finds_its_way_out_of_points_that_do_not_settle() -> None:
    """All of the first generation lies where nothing settles; the way leads to where it nearly does."""
    search = survey(bounds=BOUNDS | {"p": [-4.0, -2.999]}, population=8, starts=1, evaluations=2000).ask()[0]
    rows = run(search)
    assert rows["status"][0] == "unsettled"
    assert rows["time"][-1] == pytest.approx(1.0 + 3.999**2, abs=0.05)


def test_the_baseline_is_searched_for_too_from_the_same_gains() -> None:
    free, held, *_ = survey(baseline={"alpha": 1.0}).ask()
    assert held.design["alpha"].tolist() == [1.0, 1.0]
    assert free.design["alpha"].tolist() != [1.0, 1.0]
    assert held.design["p"].tolist() == free.design["p"].tolist()
    rows = run(held)
    assert set(rows["alpha"]) == {1.0}
    assert rows["time"].min() == pytest.approx(1.9, abs=1e-3)


def test_blocks_of_all_searches() -> None:
    asked = survey(starts=5, objectives=["t", "s"], baseline={"alpha": 1.0})
    blocks = asked.ask()
    assert asked.ask() == []
    assert [block.number for block in blocks] == list(range(2 * 2 * 2 * 2))
    assert asked.n_points == sum(block.size for block in blocks) == 5 * 2 * 2 * 2
    assert {block.size for block in blocks} == {4, 1}
    assert [block.first_point for block in blocks] == np.cumsum([0, *(block.size for block in blocks)])[:-1].tolist()
    for block in blocks:
        assert not asked.finished
        asked.tell(block.number, {})
    assert asked.finished


def test_seeds_do_not_depend_on_what_else_is_searched_for() -> None:
    alone = survey(objectives=["s"], starts=1).ask()
    among = survey(objectives=["t", "s"], starts=4).ask()
    assert alone[0].design["p"][0] == among[2].design["p"][0]
    assert len({block.design["p"][0] for block in among}) == len(among)


def test_only_what_is_named_is_varied() -> None:
    (first, *_) = survey(vary=["q"]).ask()
    rows = run(first)
    assert set(rows["p"]) == {0.0}
    assert set(rows["alpha"]) == {1.0}
    assert rows["time"].min() == pytest.approx(2.9, abs=1e-6)


@pytest.mark.parametrize(
    ("options", "name", "words"),
    [
        ({"starts": 0}, "starts", "must be at least 1"),
        ({"population": 7}, "population", "must be at least 8"),
        ({"evaluations": 23}, "evaluations", "must be at least 24"),
        ({"vary": ["gans"]}, "vary", "did you mean 'gains'?"),
        ({"vary": []}, "vary", "must name at least one of alpha, p, q"),
        ({"bounds": {"gains": [-1.0, 1.0]}}, "bounds", r"must hold \[lower, upper\] for alpha"),
        ({"bounds": BOUNDS | {"p": [1.0, 1.0]}}, "bounds.p", "the lower one first"),
        ({"bounds": BOUNDS | {"p": [1.0]}}, "bounds.p", "the lower one first"),
        ({"bounds": BOUNDS | {"orders": [0.0, 1.0]}}, "bounds.orders", r"must lie in \(0, 1\], for it bounds alpha"),
        ({"bounds": BOUNDS | {"r": [0.0, 1.0]}}, "bounds.r", "must name one of alpha, p, q"),
        ({"objectives": ["x"]}, "objectives", "must name one of t, s"),
        ({"baseline": {"r": 1.0}}, "baseline.r", "must name one of alpha, p, q"),
        ({"baseline": {"alpha": 1.5}}, "baseline.alpha", r"must lie in \(0, 1\]"),
        ({"baseline": {"alpha": 1.0, "p": 0.0, "q": 0.0}}, "baseline", "must leave at least one varied variable free"),
        ({"algorithm": "nsga2", "objectives": ["t"]}, "objectives", "must be two at least for a Pareto front"),
    ],
)
def test_what_is_refused(options: dict[str, Any], name: str, words: str) -> None:
    with pytest.raises(ArgumentError, match=words) as caught:
        survey(**options)
    assert caught.value.name == name
