"""What is refused of runs with a memory in the loop: one sentence that names the key and the cure."""

from __future__ import annotations

import pytest

from fracctl.cli.main import main
from fracctl.config.build import build_checked
from fracctl.config.compose import compose

PAIR = "evaluation=memory and solver=implicit_memory go together"
LAW = "evaluation.laws.FDA-SMC"
DRAWN = "evaluation.dispersions.initial_theta"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([f"{LAW}.type=adaptive_slidin_mode"], "did you mean 'adaptive_sliding_mode'?"),
        ([f"{LAW}.values.alpa_1=1"], "evaluation.laws.FDA-SMC.values = alpa_1: must name parameters of the law"),
        ([f"{LAW}.values.alpa_1=1"], "did you mean 'alpha_1'?"),
        ([f"{LAW}.values.nu=2"], "evaluation.laws.FDA-SMC.values.nu = 2.0: must lie in (0, 1)"),
        (["evaluation.laws.DA-SMC.values.zeta=0.5"], "evaluation.laws.DA-SMC.values.zeta = 0.5: must lie in (1,"),
        (
            ["+evaluation.laws.other={type: pd_alpha}"],
            "evaluation.laws.other.type: the implicit_memory solver does not",
        ),
        (["survey=tether_orders"], "survey.axes: several laws have their own values (evaluation.laws)"),
        (["initial_condition.release.units=si"], "Tether has none; give dimensionless values"),
        (["solver=contour"], f"evaluation.type = memory: does not go with solver.type = contour; {PAIR}"),
        (["evaluation=performance"], f"does not go with solver.type = implicit_memory; {PAIR}"),
        (["evaluation.samples=0"], "evaluation.samples = 0: must be at least 1"),
        (["evaluation.first_sample=-1"], "evaluation.first_sample = -1: must be at least 0"),
        (["measures.overshoot={}"], "measures.overshoot: is made for trajectories of"),
        ([f"+{DRAWN}=[norml,0,1]"], f"{DRAWN} = [norml, 0, 1]: must be one of normal, uniform, choice; did you mean"),
        ([f"+{DRAWN}=[normal,0]"], f"{DRAWN} = [normal, 0]: must hold 'normal' and 2 or 4 numbers"),
        ([f"+{DRAWN}=[normal,0,-1]"], f"{DRAWN} = [normal, 0, -1]: must have a deviation of at least 0"),
        ([f"+{DRAWN}=[uniform,1,0]"], f"{DRAWN} = [uniform, 1, 0]: must have its lowest value first"),
        ([f"+{DRAWN}=[]"], f"{DRAWN} = []: must be a list as [normal, 0.7, 0.02]"),
        ([f"+{DRAWN}=5"], f"{DRAWN} = 5: must be a list"),
        (["+evaluation.dispersions.initial_thet=[choice,1]"], "did you mean 'initial_theta'?"),
        (["+evaluation.dispersions.eccentricity=[choice,0]"], "evaluation.dispersions = eccentricity: must be one of"),
    ],
)
def test_a_mistake_is_one_sentence(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "experiment=tether", *words]) == 3
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1
    assert captured.err.startswith("error: ")
    assert said in captured.err


@pytest.mark.parametrize("word", ["evaluation=memory", "solver=implicit_memory"])
def test_half_of_a_pair_names_the_other(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", word]) == 3
    assert PAIR in capsys.readouterr().err


def test_a_survey_of_the_one_law() -> None:
    evaluation, survey = build_checked(compose(["experiment=tether_orders"]))
    assert survey.n_points == 16 * 9
    assert survey.slices == ("nu",)
    assert "alpha_1" in evaluation.design_variables


def test_laws_and_samples_are_axes() -> None:
    words = ["experiment=tether_monte_carlo", "evaluation.samples=5", "evaluation.first_sample=17"]
    evaluation, survey = build_checked(compose(words))
    assert {name: values.tolist() for name, values in evaluation.axes.items()} == {
        "law_number": [0.0, 1.0],
        "sample": [17.0, 18.0, 19.0, 20.0, 21.0],
    }
    assert survey.n_points == 10
    assert survey.slices == ()
    evaluation, survey = build_checked(compose(["experiment=tether"]))
    assert survey.slices == ("law_number",)
