"""The sentences, on tables made by hand."""

from __future__ import annotations

from typing import Any

import pytest

from fracctl.comparison import ComparisonEvaluation
from fracctl.comparison.findings import findings
from fracctl.config.build import build_evaluation
from fracctl.config.compose import compose


@pytest.fixture(scope="module")
def comparison() -> ComparisonEvaluation:
    evaluation = build_evaluation(compose(["experiment=fair_outofplane", "evaluation.thresholds_m=[100,10]"]))
    assert isinstance(evaluation, ComparisonEvaluation)
    return evaluation


def record(band: float, law: str, objective: float, verdict: str) -> dict[str, Any]:
    return {
        "initial_condition": "ic1",
        "limit": "gain",
        "limit_value": 2.0,
        "threshold_m": band,
        "law": law,
        "objective": objective,
        "worst_found_nearby": 2.0 * objective,
        "verdict": verdict,
    }


def table(wide: dict[str, tuple[float, str]], tight: dict[str, tuple[float, str]]) -> list[dict[str, Any]]:
    bands = ((100.0, wide), (10.0, tight))
    return [record(band, law, *found) for band, laws in bands for law, found in laws.items()]


REFERENCE = (4.0, "reference")
REST = {"pid": (5.0, "worse"), "lqr": (4.0, "equal")}


def test_where_a_fractional_order_helps_and_where_it_does_not(comparison: ComparisonEvaluation) -> None:
    wide = {"pd": REFERENCE, "pd_alpha": (3.0, "better"), "pd_lag": (3.75, "better"), **REST}
    tight = {"pd": REFERENCE, "pd_alpha": (4.0, "equal"), "pd_lag": (2.0, "better"), **REST}
    told = "\n".join(findings(comparison, table(wide, tight)))
    assert (
        "pd_alpha (of fractional order) against pd, settling to 100 m better in 1 of 1; to 10 m equal in 1 of 1" in told
    )
    assert "helps against the best of pd, pd_lag, pid, lqr in 1 of 2 problems" in told
    assert "ic1 to 100 m, gains up to 2 (20 % ahead of pd_lag)" in told
    assert "no difference beyond 2 % in 0 and is behind in 1" in told
    assert "best law: pd_alpha in 1, pd_lag in 1 of 2 problems" in told
    assert "pd 2, pd_alpha 2" in told


def test_what_is_left_undecided(comparison: ComparisonEvaluation) -> None:
    laws = {"pd": REFERENCE, "pd_alpha": (3.0, "better"), "pd_lag": (3.75, "better"), **REST, "pid": (4.1, "undecided")}
    told = list(findings(comparison, table(laws, laws)))
    assert any("undecided" in sentence and "pid 2 of 2" in sentence for sentence in told)
