"""Names that the command line gives to entries of open mappings: a misspelt one is not one more entry."""

from __future__ import annotations

from pathlib import Path

import pytest

from fracctl.cli.main import main
from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.errors import FracctlError


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["objectives.setling_time=[overshoot]"], "did you mean 'objectives.settling_time'?"),
        (["figures.trajectoris.type=poles"], "did you mean 'figures.trajectories'?"),
        (["experiment=flight_ic1", "evaluation.laws.pd_alhpa.type=pd"], "did you mean 'evaluation.laws.pd_alpha'?"),
        (["experiment=flight_ic1", "evaluation.laws={pd_alhpa:{type:pd}}"], "did you mean 'evaluation.laws.pd_alpha'?"),
        (
            ["experiment=flight_ic1", "evaluation.band_m.ic1_tenht=1"],
            "unknown key 'evaluation.band_m.ic1_tenht'; did you mean 'evaluation.band_m.ic1_tenth'?",
        ),
        (
            ["experiment=flight_design", "evaluation.dispersions.offset_w_percnt=null"],
            "offset_w_percnt = null: takes nothing away; did you mean 'evaluation.dispersions.offset_w_percent'?",
        ),
    ],
)
def test_a_misspelt_entry_is_not_one_more(words: list[str], said: str) -> None:
    with pytest.raises(FracctlError) as caught:
        compose(words)
    assert said in str(caught.value)
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    "words",
    [
        ["initial_condition.ic2.w=0.1"],
        ["initial_condition.mine.w=0.1"],
        ["initial_condition=own", "initial_condition.own.w=1"],
        ["initial_condition=own", "initial_condition.own.w=1", "initial_condition.own_far.w=2"],
        ["objectives.peak=[overshoot]"],
        ["experiment=flight_ic1", "evaluation.band_m.ic1_tenth=10"],
        ["experiment=flight_ic1", "initial_condition=ic1"],
        ["experiment=flight_design", "evaluation.dispersions.offset_w_percent=null"],
    ],
)
def test_entries_that_are_meant(words: list[str]) -> None:
    compose(words)


def test_the_names_of_a_study_are_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "my_study"]) == 0
    capsys.readouterr()
    assert main(["validate", "my_study", "initial_condition.strt.v=1"]) == 3
    said = (
        "error: unknown key 'initial_condition.strt'; did you mean 'initial_condition.start'? A new entry needs a name"
    )
    assert capsys.readouterr().err.startswith(said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["experiment=flight_ic1", "controller.k_p_w=9"], "set evaluation.laws.NAME.values.k_p_w"),
        (["experiment=flight_ic1", "plant=hcw", "controller.k_p_w=9"], "set evaluation.laws.NAME.values.k_p_w"),
        (["experiment=fair_outofplane", "controller=lqr"], "the laws are those of evaluation.laws (pd, pd_alpha, "),
        (["experiment=tether", "controller.reference_target=0.5"], "controller.reference_target=0.5: plays no part"),
    ],
)
def test_a_controller_beside_laws_is_refused(words: list[str], said: str) -> None:
    with pytest.raises(FracctlError) as caught:
        compose(words)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "words",
    [
        ["experiment=flight_ic1", "evaluation=flight", "controller.k_p_w=0.85"],
        ["experiment=flight_ic1", "plant=hcw", "controller=pd_alpha_full"],
        ["experiment=flight_ic1", "~controller.k_p_w"],
        ["experiment=tether_retrieval"],
    ],
)
def test_a_controller_that_is_the_law_or_fits_the_plant(words: list[str]) -> None:
    compose(words)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["figures.trajectories.shows=nonsense"], "figures of type trajectories have nothing to choose; leave it out"),
        (["experiment=tether", "figures=tether", "figures.length.shows=lenght"], "did you mean 'length'?"),
        (
            ["experiment=tether_monte_carlo", "figures.spread.shows=overshot_percent"],
            "did you mean 'overshoot_percent'?",
        ),
        (["figures.trajectories.initial_conditions=[]"], "must not be empty"),
        (
            ["experiment=ic1_inplane_search", "survey.objectives=[]"],
            "survey.objectives = []: must be null or name one of",
        ),
    ],
)
def test_what_a_figure_or_a_search_is_asked_for_must_be_there(words: list[str], said: str) -> None:
    with pytest.raises(FracctlError) as caught:
        build_checked(compose(words))
    assert said in str(caught.value)
