"""Composition, and the traps of Hydra that must not be walked into silently."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from hydra import compose as hydra_compose
from hydra import initialize_config_dir, version
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.core.utils import JobRuntime

from fracctl.config.catalogue import built_in_directory
from fracctl.config.compose import compose, to_yaml
from fracctl.errors import ConfigurationError, FracctlError, UsageError


def refusal(*words: str, config_dir: Path | None = None) -> str:
    with pytest.raises(FracctlError) as caught:
        compose(words, config_dir)
    return str(caught.value)


def test_without_overrides_a_single_out_of_plane_loop() -> None:
    config = compose([])
    assert (config.name, config.plant.type, config.survey.type) == ("custom", "hcw_out_of_plane", "single")
    assert dict(config.controller) == {"type": "pd_alpha", "alpha_w": 1.0, "k_p_w": 0.55, "k_d_w": 2.0}
    assert list(config.initial_condition) == ["ic1"]


def test_an_experiment_overrides_groups_and_the_command_line_overrides_it() -> None:
    config = compose(
        ["experiment=ic2_outofplane", "initial_condition=ic3", "scheduler=serial", "solver.tolerance=1e-6"]
    )
    assert config.name == "ic2_outofplane"
    assert list(config.initial_condition) == ["ic3"]
    assert config.scheduler.type == "serial"
    assert config.solver.model_dump() == {"type": "contour", "tolerance": 1e-6, "cross_check": 0.01}


def test_the_order_of_words_does_not_matter_between_keys_and_groups() -> None:
    assert compose(["name=x", "experiment=ic1_outofplane"]) == compose(["experiment=ic1_outofplane", "name=x"])


def test_several_initial_conditions_in_one_run() -> None:
    assert list(compose(["initial_condition=[ic1,ic3]"]).initial_condition) == ["ic1", "ic3"]


@pytest.mark.parametrize("word", ["figures=null", "figures=[]"])
def test_figures_can_be_left_out(word: str) -> None:
    assert compose([word]).figures == {}


@pytest.mark.parametrize("prefix", ["", "+", "++"])
def test_a_key_that_exists_is_set_with_any_prefix(prefix: str) -> None:
    assert compose([f"{prefix}controller.alpha_w=0.9"]).controller.model_dump()["alpha_w"] == 0.9


@pytest.mark.parametrize("prefix", ["", "+", "++"])
def test_an_unknown_key_is_refused_with_any_prefix(prefix: str) -> None:
    assert refusal(f"{prefix}controller.alhpa_w=1") == (
        "unknown key 'controller.alhpa_w'; did you mean 'controller.alpha_w'?"
    )


@pytest.mark.parametrize("prefix", ["", "+", "++"])
def test_a_key_without_likeness_is_refused_with_what_is_allowed(prefix: str) -> None:
    assert refusal(f"{prefix}controller.foo=1") == (
        "unknown key 'controller.foo'; allowed: type, alpha_w, k_p_w, k_d_w"
    )


def test_a_misspelt_group_is_refused() -> None:
    assert refusal("plnat=hcw") == "unknown key 'plnat'; did you mean 'plant'?"


def test_a_deep_unknown_key_is_named_whole() -> None:
    assert refusal("experiment.foo.bar=1").startswith("unknown key 'experiment.foo.bar'")


def test_a_misspelt_experiment_does_not_run_the_default() -> None:
    assert refusal("experiment=ic1_outofplan") == (
        "there is no experiment 'ic1_outofplan'; did you mean 'ic1_outofplane'?"
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["experiment=[ic1_outofplane,ic2_outofplane]"], "a run has one experiment; for a run with each, write -m"),
        (["experiment=ic1_outofplane", "experiment=ic2_outofplane"], "experiment is chosen twice"),
        (["plant=hcw", "plant=hcw_in_plane"], "plant is chosen twice"),
        (["initial_condition=ic1", "initial_condition=ic2"], "for both in one run, write initial_condition=[ic1,ic2]"),
        (["figures=[poles]", "figures=[trajectories,bode]"], "one run, write figures=[poles,trajectories,bode]"),
        (["plant=[hcw,hcw_in_plane]"], "a run has one plant"),
        (["hydra.run.dir=x"], "runs are stored below output_dir=DIR"),
        (["hydra/launcher=basic"], "Hydra's own settings"),
        (["+hydra.sweep.dir=x"], "Hydra's own settings"),
        (["~plant"], "'~plant' would leave the run without its plant; choose another with plant=NAME"),
        (["~experiment"], "write experiment=null"),
        (["plant=null"], "would leave the run without its plant"),
        (["plant={type:hcw}"], "plant takes the name of an option"),
        (["plant="], "plant takes the name of an option"),
        (["plant@other=hcw"], "'@' has no meaning here"),
        (["plant/sub=hcw"], "there is no group 'plant/sub'"),
        (["initial_condition=[]"], "initial_condition is missing"),
        (["~controller.foo"], "there is no key 'controller.foo' to remove"),
        (["name=${foo}"], "name: Interpolation key 'foo' not found"),
        (["name=???"], "name has no value; set name=VALUE"),
        (["seed={1:2}"], "the key 1 under 'seed' is not text"),
    ],
)
def test_what_hydra_would_take_silently_or_say_obscurely(words: list[str], said: str) -> None:
    with pytest.raises(ConfigurationError, match=re.escape(said)) as caught:
        compose(words)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("experiment=ic1_outofplane,ic2_outofplane", "names several runs; add -m to run them all"),
        ("controller.alpha_w=range(0.9,1.0,0.01)", "names several runs; add -m to run them all"),
        ("survey.axes.alpha_w=range(0.9,1.0,0.01)", "an axis of a survey is written start:stop:step"),
        ("survey.axes.alpha_w=0.9,1.0", "a list is written 'survey.axes.alpha_w=[0.9,1.0]'"),
        ("ic1_outofplane", "did you mean 'experiment=ic1_outofplane'?"),
        ("foo", "neither an override, KEY=VALUE"),
        ("foo.yaml", "no foo.yaml; 'fracctl init foo' writes one, 'fracctl list experiments' names what there is"),
        ("=1", "write KEY=VALUE"),
        ("~seed=77", "a key is removed whatever its value; write '~seed', or 'seed=77' to set it"),
        ("name='a", "cannot read"),
        ("controller.alpha_w=interval(0,1)", "has no list of values"),
    ],
)
def test_words_that_are_no_override_of_one_run(word: str, said: str) -> None:
    with pytest.raises(UsageError, match=re.escape(said)) as caught:
        compose([word])
    assert caught.value.exit_code == 2


def test_a_list_does_not_replace_a_mapping() -> None:
    assert refusal("survey=out_of_plane", "survey.axes=[0.9,1.0]") == (
        "cannot set 'survey.axes=[0.9,1.0]': a mapping stays a mapping; set its keys one by one, survey.axes.KEY=VALUE"
    )


def test_a_key_can_be_removed() -> None:
    config = compose(["survey=out_of_plane", "~survey.axes.k_p_w"])
    assert list(config.survey.model_dump()["axes"]) == ["alpha_w", "k_d_w"]


def test_keys_of_an_experiment_that_another_law_does_not_have(tmp_path: Path) -> None:
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "mine.yaml").write_text("# mine\ncontroller:\n  alpha_w: 0.9\n")
    assert refusal("experiment=mine", "controller=pd", config_dir=tmp_path) == (
        "key 'controller.alpha_w' does not fit controller=pd, but is set by experiment=mine; choose another controller "
        "('fracctl list controller'), or remove it with '~controller.alpha_w'"
    )
    assert compose(["experiment=mine", "controller=pd", "~controller.alpha_w"], tmp_path).controller.type == "pd"


def test_axes_that_an_experiment_chose_and_another_law_does_not_have() -> None:
    said = refusal("experiment=ic1_outofplane", "controller=pd")
    assert "keys 'survey.axes.alpha_w', 'survey.baseline.alpha_w' do not fit controller=pd" in said
    assert "set by survey=out_of_plane, which experiment=ic1_outofplane chooses" in said
    assert "did you mean" not in said
    cured = compose(["experiment=ic1_outofplane", "controller=pd", "survey=out_of_plane_gains", "figures=null"])
    assert list(cured.survey.model_dump()["axes"]) == ["k_p_w", "k_d_w"]


def test_a_plant_that_does_not_fit_the_law_chosen_by_default() -> None:
    said = refusal("plant=hcw_in_plane")
    assert said.startswith("keys 'controller.alpha_w', 'controller.k_p_w', 'controller.k_d_w' do not fit plant=hcw_in_")
    assert "are set by controller=pd_alpha" in said


def test_a_law_that_does_not_fit_the_plant_chosen_by_default() -> None:
    said = refusal("controller=pd_alpha_in_plane")
    assert "do not fit plant=hcw_out_of_plane, but are set by controller=pd_alpha_in_plane" in said
    assert "did you mean" not in said


def test_a_typo_in_a_file_is_a_typo(tmp_path: Path) -> None:
    (tmp_path / "controller").mkdir()
    (tmp_path / "controller" / "mine.yaml").write_text("# mine\ntype: pd_alpha\nalhpa_w: 0.9\n")
    assert refusal("controller=mine", config_dir=tmp_path) == (
        "unknown key 'controller.alhpa_w' in controller=mine; did you mean 'controller.alpha_w'?"
    )


def test_a_value_of_a_file_is_refused_with_the_file(tmp_path: Path) -> None:
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "mine.yaml").write_text("# @package _global_\nhorizon_periods: -1\n")
    assert refusal("experiment=mine", config_dir=tmp_path) == (
        "horizon_periods = -1: must be above 0 (set by experiment=mine)"
    )


def test_a_directory_of_ones_own_comes_first(tmp_path: Path) -> None:
    for group, text in {"solver": "type: contour\ntolerance: 1.0e-5", "controller": "type: pd"}.items():
        (tmp_path / group).mkdir()
        (tmp_path / group / ("contour.yaml" if group == "solver" else "soft.yaml")).write_text(f"# own\n{text}\n")
    config = compose(["controller=soft"], tmp_path)
    assert config.solver.model_dump()["tolerance"] == 1e-5
    assert config.controller.model_dump() == {"type": "pd", "k_p_w": 0.0, "k_d_w": 0.0}


@pytest.mark.parametrize(("name", "said"), [("nowhere", "does not exist"), ("file.yaml", "is not a directory")])
def test_a_missing_directory_is_an_error(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / "file.yaml").write_text("")
    assert said in refusal(config_dir=tmp_path / name)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("solver: [", "not valid YAML"),
        ("survey:\n  type: grid\n  axes:\n    k_p_w: 0:2:0.05\n", "line 4: YAML reads 0:2:0.05 as a number in base 60"),
        ("plant:\n  on: 1\n", "line 2: YAML does not read the key 'on' as text; put it in quotes"),
        ("defaults:\n  - override /plant: nowhere\n", "Could not find 'plant/nowhere'"),
        ("name: ${oc.env:NOT_SET_ANYWHERE}\n", "Environment variable 'NOT_SET_ANYWHERE' not found"),
        ("- a\n- b\n", "experiment/mine"),
    ],
)
def test_a_file_that_cannot_be_read_as_meant(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "mine.yaml").write_text(text)
    message = refusal("experiment=mine", config_dir=tmp_path)
    assert said in message
    assert "\n" not in message


def test_keys_n_y_and_quoted_on_are_names() -> None:
    words = ["plant=linear", "plant.stiffness=[[-1,0,0],[0,-1,0],[0,0,-1]]", "plant.components=[n,y,'on']"]
    words += ["controller=pd_alpha_own", "initial_condition=own", "initial_condition.own.n=1"]
    config = compose([*words, "initial_condition.own.on=2"])
    assert config.initial_condition["own"].model_dump()["on"] == 2.0
    printed = to_yaml(config)
    assert "'on': 2.0" in printed
    assert "'n': 1.0" in printed


def test_both_ends_of_an_axis_belong_to_it() -> None:
    config = compose(["survey=out_of_plane", "survey.axes.alpha_w=0.9:1.0:0.01"])
    assert config.survey.model_dump()["axes"]["alpha_w"] == "0.9:1.0:0.01"


def test_inside_a_users_own_hydra_application() -> None:
    with initialize_config_dir(str(built_in_directory()), version_base="1.2", job_name="theirs"):
        theirs = GlobalHydra.instance()
        hydra = theirs.hydra
        assert compose(["experiment=outofplane"]).name == "outofplane"
        with pytest.raises(ConfigurationError):
            compose(["experiment=nowhere"])
        assert GlobalHydra.instance() is theirs
        assert theirs.hydra is hydra
        assert str(version.getbase()) == "1.2"
        assert JobRuntime.instance().get("name") == "theirs"
        assert hydra_compose("config", ["solver.tolerance=1e-5"]).solver.tolerance == 1e-5


def test_hydra_is_left_as_it_was_found() -> None:
    assert not GlobalHydra.instance().is_initialized()
    compose([])
    assert not GlobalHydra.instance().is_initialized()
    assert not HydraConfig.initialized()


def test_a_directory_with_blanks_in_its_name(tmp_path: Path) -> None:
    directory = tmp_path / "my own = conf"
    shutil.copytree(built_in_directory() / "solver", directory / "solver")
    assert compose([], directory) == compose([])
