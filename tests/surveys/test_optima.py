"""Which rows are optima."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fracctl.surveys import Optima

OBJECTIVES = {"time": ("settling_time",), "joint": ("settling_time", "control_effort")}


def rows(*entries: dict[str, Any]) -> dict[str, np.ndarray]:
    default: dict[str, Any] = {
        "initial_condition": "one",
        "a": 1.0,
        "k": 0.0,
        "settling_time": 1.0,
        "control_effort": 1.0,
    }
    default |= {"status": "ok", "stable": True}
    full = [default | entry for entry in entries]
    for row in full:
        row["objective_time"] = row["settling_time"]
        row["objective_joint"] = np.sqrt(row["settling_time"] * row["control_effort"])
    objects = ("initial_condition", "status", "stable")
    return {name: np.array([r[name] for r in full], dtype=object if name in objects else None) for name in full[0]}


def optima(*parts: dict[str, np.ndarray], **options: Any) -> list[dict[str, Any]]:
    selection = Optima(OBJECTIVES, ("a", "k"), **options)
    for part in parts:
        selection.add(part)
    return selection.rows()


def overall(*parts: dict[str, np.ndarray], objective: str = "time") -> dict[str, Any] | None:
    found = [r for r in optima(*parts) if r["kind"] == "overall" and r["objective_name"] == objective]
    return found[0] if found else None


def test_the_smallest_finite_objective_wins() -> None:
    best = overall(rows({"k": 1.0, "settling_time": 3.0}, {"k": 2.0, "settling_time": 2.0}, {"settling_time": np.inf}))
    assert best is not None
    assert (best["k"], best["settling_time"]) == (2.0, 2.0)


@pytest.mark.parametrize(
    "worse",
    [
        {"status": "unsettled"},
        {"status": "failed"},
        {"stable": False},
        {"stable": np.False_},
        {"settling_time": np.nan},
    ],
)
def test_a_row_that_is_not_to_be_trusted_is_no_optimum(worse: dict[str, Any]) -> None:
    assert overall(rows({"settling_time": 0.5} | worse)) is None
    best = overall(rows({"settling_time": 0.5} | worse, {"k": 2.0}))
    assert best is not None
    assert best["k"] == 2.0


def test_an_undecided_verdict_is_allowed() -> None:
    assert overall(rows({"stable": None})) is not None


def test_ties_go_to_the_smallest_effort_then_to_the_smallest_gains() -> None:
    tied = rows({"k": 1.0, "control_effort": 2.0}, {"k": 3.0, "control_effort": 1.5}, {"k": 2.0, "control_effort": 1.5})
    best = overall(tied)
    assert best is not None
    assert best["k"] == 2.0
    first = overall(rows({"a": 0.9, "k": 5.0}, {"a": 0.8, "k": 7.0}))
    assert first is not None
    assert first["a"] == 0.8


def test_no_effort_is_no_optimum_of_a_combined_objective() -> None:
    free = rows({"control_effort": 0.0, "settling_time": 0.5}, {"k": 2.0})
    joint, time = overall(free, objective="joint"), overall(free)
    assert joint is not None
    assert time is not None
    assert (joint["k"], time["k"]) == (2.0, 0.0)


def test_slices_and_baseline() -> None:
    table = rows(
        *({"a": a, "k": k, "settling_time": a * (2.0 + (k - 2.0) ** 2)} for a in (0.8, 0.9, 1.0) for k in (1.0, 2.0))
    )
    found = optima(table, slices=("a",), baseline={"a": 1.0})
    assert [(r["kind"], r["slice"], r["a"], r["k"]) for r in found if r["objective_name"] == "time"] == [
        ("overall", None, 0.8, 2.0),
        ("baseline", None, 1.0, 2.0),
        ("slice", 0.8, 0.8, 2.0),
        ("slice", 0.9, 0.9, 2.0),
        ("slice", 1.0, 1.0, 2.0),
    ]


def test_no_baseline_among_the_points() -> None:
    assert [r["kind"] for r in optima(rows({"a": 0.9}), baseline={"a": 1.0})] == ["overall", "overall"]


def test_each_initial_condition_has_its_own() -> None:
    table = rows({"initial_condition": "b", "k": 1.0}, {"initial_condition": "a", "k": 2.0, "settling_time": 0.1})
    assert [(r["objective_name"], r["initial_condition"], r["k"]) for r in optima(table)] == [
        ("time", "b", 1.0),
        ("time", "a", 2.0),
        ("joint", "b", 1.0),
        ("joint", "a", 2.0),
    ]


def test_parts_make_no_difference() -> None:
    rng = np.random.default_rng(1)
    entries = [
        {
            "a": float(a),
            "k": float(k),
            "settling_time": float(rng.integers(1, 4)),
            "control_effort": float(rng.integers(0, 3)),
        }
        for a in range(4)
        for k in range(12)
    ]
    whole = optima(rows(*entries), slices=("a",), baseline={"a": 1.0})
    assert len(whole) == 2 * 6
    for size in (1, 5, 16):
        parts = [rows(*entries[i : i + size]) for i in range(0, len(entries), size)]
        assert optima(*parts, slices=("a",), baseline={"a": 1.0}) == whole
        assert optima(*reversed(parts), slices=("a",), baseline={"a": 1.0}) == whole


def test_values_are_plain() -> None:
    best = overall(rows({"k": 1.0}))
    assert best is not None
    assert type(best["k"]) is float


FAILING: dict[str, Any] = {"settling_time": np.nan, "status": "collision"}


def test_a_law_that_fails_is_still_the_one_of_its_slice() -> None:
    table = rows({"a": 0.8}, {"a": 0.9} | FAILING, {"a": 1.0, "stable": False})
    kept = optima(table, slices=("a",), any_single=True)
    found = [(r["kind"], r["a"], r["status"]) for r in kept if r["objective_name"] == "time"]
    slices = [("slice", 0.8, "ok"), ("slice", 0.9, "collision"), ("slice", 1.0, "ok")]
    assert found == [("overall", 0.8, "ok"), *slices], "never the best of all"
    assert [r["a"] for r in optima(table, slices=("a",)) if r["kind"] == "slice"] == [0.8, 0.8]


def test_a_single_point_that_failed_to_compute_is_no_slice() -> None:
    assert optima(rows({"status": "failed"}), slices=("a",), baseline={"a": 1.0}, any_single=True) == []


def test_a_single_baseline_counts_whatever_it_is() -> None:
    table = rows({"a": 0.9}, {"a": 1.0} | FAILING)
    (joint, time) = (r for r in optima(table, baseline={"a": 1.0}, any_single=True) if r["kind"] == "baseline")
    assert joint["status"] == time["status"] == "collision"


@pytest.mark.parametrize("kinds", [{"slices": ("a",)}, {"baseline": {"a": 1.0}}])
def test_of_several_points_one_must_be_a_candidate(kinds: dict[str, Any]) -> None:
    """Also where they come in different parts."""
    bad, worse, good = ({"k": k} | (FAILING if k < 3.0 else {}) for k in (1.0, 2.0, 3.0))
    assert optima(rows(bad, worse), any_single=True, **kinds) == []
    assert optima(rows(bad), rows(worse), any_single=True, **kinds) == []
    for parts in ([rows(bad, worse, good)], [rows(bad), rows(worse), rows(good)], [rows(good), rows(bad, worse)]):
        found = [r["k"] for r in optima(*parts, any_single=True, **kinds) if r["kind"] in ("slice", "baseline")]
        assert found == [3.0, 3.0], "one for each objective"
