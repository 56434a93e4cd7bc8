"""The overrides that lead to a configuration: they compose to the same run."""

from __future__ import annotations

from pathlib import Path

import pytest

from fracctl.config.catalogue import catalogue
from fracctl.config.compose import compose
from fracctl.config.repeat import overrides_for
from fracctl.config.schemas import RunConfig
from fracctl.store.identity import run_id


def id_of(config: RunConfig) -> str:
    return run_id(config.model_dump(mode="json"))


@pytest.mark.parametrize("name", [name for name in catalogue().options("experiment") if "flight" not in name][::12])
def test_an_experiment_as_it_stands_needs_its_name_only(name: str) -> None:
    assert overrides_for(compose([f"experiment={name}"])) == (f"experiment={name}",)


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ([], []),
        (["controller.alpha_w=0.91", "seed=3"], ["controller.alpha_w=0.91", "seed=3"]),
        (
            ["experiment=ic1_outofplane", "survey.axes.k_d_w=0:4:0.1", "figures=bode", "scheduler=serial"],
            ["experiment=ic1_outofplane", "figures=bode", "survey.axes.k_d_w=0:4:0.1"],
        ),
        (
            ["initial_condition=own", "initial_condition.own.units=si", "initial_condition.own.w=500"],
            ["initial_condition=own", "initial_condition.own.units=si", "initial_condition.own.w=500.0"],
        ),
        (
            ["plant=hcw_in_plane", "controller=pd_alpha_in_plane", "survey=in_plane", "name=mine"],
            ["controller=pd_alpha_in_plane", "plant=hcw_in_plane", "survey=in_plane", "name=mine"],
        ),
        (
            ["initial_condition=[ic1,ic3]", "measures=margins", "constraints.phase_margin_deg='>= 60'"],
            ["initial_condition=[ic1,ic3]", "measures=margins", "constraints.phase_margin_deg='>= 60'"],
        ),
        (
            ["experiment=flight_design", "~constraints.peak_acceleration_mm_s2", "output_dir=elsewhere"],
            ["experiment=flight_design", "~constraints.peak_acceleration_mm_s2"],
        ),
        (
            [
                "experiment=flight_ic1",
                "initial_condition=ic2_distances",
                "evaluation=flight_laws_ic2",
                "evaluation.band_m=9",
            ],
            [
                "experiment=flight_ic1",
                "evaluation=flight_laws_ic2",
                "initial_condition=ic2_distances",
                "evaluation.band_m=9.0",
            ],
        ),
        (["horizon_periods=null", "horizon_min=500"], ["horizon_periods=null", "horizon_min=500.0"]),
    ],
    ids=lambda words: " ".join(words) or "nothing",
)
def test_what_was_set_is_found_and_gives_the_same_id(words: list[str], found: list[str]) -> None:
    config = compose(words)
    answer = overrides_for(config)
    assert answer is not None
    assert list(answer) == found
    assert id_of(compose(answer)) == id_of(config)
    assert compose(answer).figures == config.figures


def test_an_experiment_of_ones_own_is_found_in_its_directory(tmp_path: Path) -> None:
    (tmp_path / "experiment").mkdir()
    text = "# Mine.\n# @package _global_\nname: my_study\ncontroller:\n  alpha_w: 0.93\n"
    (tmp_path / "experiment" / "study.yaml").write_text(text, encoding="utf-8")
    config = compose(["experiment=study", "controller.k_p_w=0.7"], tmp_path)
    assert overrides_for(config, tmp_path) == ("experiment=study", "controller.k_p_w=0.7")
    without = overrides_for(config)
    assert without is not None
    assert "name=my_study" in without
    assert id_of(compose(without)) == id_of(config)


def test_a_key_that_is_no_word_leads_nowhere() -> None:
    config = compose(["experiment=tether_monte_carlo", "evaluation=tether_laws"])
    assert any(" " in name for name in config.evaluation.laws)  # type: ignore[attr-defined]
    assert overrides_for(config) is None
