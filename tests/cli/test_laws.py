"""Tables of several laws and of dispersed runs, as they are read."""

from __future__ import annotations

from typing import Any

from fracctl.cli.laws import law_lines, quantile_lines, survival_lines


def law(name: str, settling: float | None, condition: str = "release") -> dict[str, Any]:
    return {
        "initial_condition": condition,
        "law": name,
        "settling_2_percent_orbits": settling,
        "overshoot_percent": 2.73456789,
        "vartheta_1": None if name == "FO-SMC (reconstruction)" else 10.5,
        "status": "ok" if settling else "unsettled",
    }


def test_a_column_for_each_law_and_a_row_for_each_measure() -> None:
    lines = law_lines([law("FDA-SMC", 0.2730241), law("FO-SMC (reconstruction)", None)])
    assert [line.split() for line in lines] == [
        ["release", "FDA-SMC", "FO-SMC", "(reconstruction)"],
        ["settling_2_percent_orbits", "0.27302", "never"],
        ["overshoot_percent", "2.7346", "2.7346"],
        ["vartheta_1", "10.5", "-"],
        ["status", "ok", "unsettled"],
    ]
    starts = {line.index(word) for line, word in zip(lines, ("FDA", "0.27", "2.73", "10.5", "ok"), strict=True)}
    assert len(starts) == 1, "aligned"


def test_a_part_for_each_start() -> None:
    lines = law_lines([law("one", 1.0), law("one", 2.0, "release_fast"), law("two", 3.0, "release_fast")])
    assert [line.split() for line in lines if "release" in line] == [["release", "one"], ["release_fast", "one", "two"]]


def quantiles(measure: str, **further: Any) -> dict[str, Any]:
    spread = {"quantile_05": 0.26, "quantile_05_low": None, "quantile_05_high": 0.27, "median": 0.3}
    spread |= {"quantile_95": 0.4, "quantile_95_low": 0.35, "quantile_95_high": None}
    spread |= {"smallest": 0.25, "smallest_sample": 17.0, "largest": None, "largest_sample": 96.0}
    return {"initial_condition": "release", "law": "FDA-SMC", "measure": measure, "samples": 40, **spread, **further}


def test_quantiles_with_the_interval_and_the_samples_of_the_extremes() -> None:
    head, row = quantile_lines([quantiles("settling_2_percent_orbits")])
    for heading in ("release, FDA-SMC", "5 %", "median", "95 %", "interval of 95 %", "smallest", "largest"):
        assert heading in head
    assert row.split() == ["settling_2_percent_orbits", "0.26", "0.3", "0.4", "[0.35,", "∞]", "0.25", "17", "∞", "96"]
    assert row.index("[0.35") == head.index("interval")


def test_what_does_not_vary_is_left_out() -> None:
    same = quantiles("tension_min", smallest=0.1, largest=0.1)
    assert len(quantile_lines([quantiles("tension_max"), same])) == 2


def test_a_part_for_each_group_with_the_values_of_its_parameters() -> None:
    parts = [quantiles("tension_max"), quantiles("tension_max", law="DA-SMC")]
    assert [line.split("  ")[1] for line in quantile_lines(parts)[::2]] == ["release, FDA-SMC", "release, DA-SMC"]
    one = {"initial_condition": "release", "alpha_1": 0.5} | {
        name: value for name, value in quantiles("tension_max").items() if name not in ("initial_condition", "law")
    }
    assert quantile_lines([one])[0].startswith("  release, alpha_1 = 0.5")


def survivor(stage: str, samples: int, **further: Any) -> dict[str, Any]:
    record = {"initial_condition": "ic1", "law": "pd", "stage": stage, "band_m": 100.0, "samples": samples}
    record |= {"settled_percent": 100.0, "settled_percent_low": 99.265, "settled_percent_high": 100.0}
    record |= {"median_orbits": 0.46, "quantile_95_orbits": 0.812}
    record |= {"quantile_95_low_orbits": 0.79, "quantile_95_high_orbits": None, "worst_sample": 117.0}
    return record | {"limited_percent": 1.25, "median_delta_v_m_s": 54.0} | further


def test_survival_with_intervals_and_the_worst_sample() -> None:
    head, row = survival_lines([survivor("ideal", 1), survivor("dispersed", 500)])
    for heading in ("ic1, orbits to 100 m", "ideal", "dispersed", "interval of 95 %", "% settled", "worst sample"):
        assert heading in head
    assert row.split() == [
        "pd",
        "0.460",
        "0.460",
        "(0.812)",
        "[0.790,",
        "∞]",
        "100",
        "[99.3,",
        "100]",
        "117",
        "1.25",
        "54",
    ]
    assert row.index("[0.790") == head.index("interval")


def test_what_never_settles_has_no_interval() -> None:
    never = dict.fromkeys(("median_orbits", "quantile_95_orbits", "quantile_95_low_orbits", "quantile_95_high_orbits"))
    _, row = survival_lines([survivor("dispersed", 500, settled_percent_low=0.0, **never)])
    assert row.split()[:3] == ["pd", "never", "never"]
    assert "∞" not in row


def test_a_single_flight_has_no_interval() -> None:
    head, row = survival_lines([survivor("ideal", 1), survivor("noisy", 1)])
    assert "interval" not in head
    assert "worst" not in head
    assert row.split() == ["pd", "0.460", "0.460", "100", "1.25", "54"]
