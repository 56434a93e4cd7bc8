"""Extensions: plants, laws, measures, surveys and YAML files from other packages, through entry points."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import dedent

import pytest

from fracctl.config import registry
from fracctl.config.build import build_evaluation, build_survey
from fracctl.config.catalogue import catalogue
from fracctl.config.compose import compose
from fracctl.errors import ConfigurationError

MODULE = """
    from fracctl.controllers import PDAlpha
    from fracctl.errors import ArgumentError
    from fracctl.plants import LinearPlant
    from fracctl.surveys import Single

    class Pendulum(LinearPlant):
        def __init__(self, length: float, damping: float = 0.0) -> None:
            if length <= 0.0:
                raise ArgumentError("length", length, "must be positive")
            super().__init__(-1.0 / length, -damping, ("w",))

    class Law(PDAlpha):
        pass

    class Peak:
        name = "peak"
        columns = ("peak",)
        def __init__(self, scale: float = 1.0) -> None:
            self.scale = scale
        def __call__(self, trajectory):
            return {"peak": abs(trajectory.positions).max(axis=(1, 2)) * self.scale}

    class Twice(Single):
        def __init__(self, evaluation, seed: int, factor: float = 2.0) -> None:
            super().__init__({name: factor * value for name, value in evaluation.parameters.items()})
"""

ENTRY_POINTS = """
    [fracctl.plants]
    pendulum = extension:Pendulum
    broken = extension:Missing
    [fracctl.controllers]
    law = extension:Law
    [fracctl.measures]
    peak = extension:Peak
    [fracctl.surveys]
    twice = extension:Twice
    [fracctl.conf]
    extension = extension_conf
"""


@pytest.fixture
def extension(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An installed package that extends fracctl."""
    (tmp_path / "extension.py").write_text(dedent(MODULE))
    info = tmp_path / "extension-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: extension\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(dedent(ENTRY_POINTS))
    conf = tmp_path / "extension_conf"
    (conf / "plant").mkdir(parents=True)
    (conf / "__init__.py").write_text("")
    (conf / "plant" / "pendulum.yaml").write_text("# A pendulum.\ntype: pendulum\nlength: 2.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    registry.entry_points.cache_clear()
    yield tmp_path
    registry.entry_points.cache_clear()
    for name in ("extension", "extension_conf"):
        sys.modules.pop(name, None)


@pytest.mark.usefixtures("extension")
def test_everything_can_come_from_outside() -> None:
    words = ["plant=pendulum", "plant.damping=0.1", "controller.type=law", "survey.type=twice", "survey.factor=3"]
    config = compose([*words, "measures.peak.scale=2", "objectives.peak=[peak]", "objective=peak", "figures=null"])
    evaluation = build_evaluation(config)
    assert evaluation.plant.stiffness.item() == -0.5
    (block,) = build_survey(config, evaluation).ask()
    assert block.design["k_p_w"].tolist() == [3 * 0.55]
    rows = evaluation({"alpha_w": [0.9], "k_p_w": [1.0], "k_d_w": [1.0]})
    assert rows["objective"].tolist() == rows["peak"].tolist()


@pytest.mark.usefixtures("extension")
@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("plant.length=-1", "plant.length = -1: must be positive"),
        ("plant.lenght=1", "unknown key 'plant.lenght'; did you mean 'plant.length'?"),
        ("plant.type=pendulun", "did you mean 'pendulum'?"),
        ("plant.type=broken", "package 'extension': 'extension:Missing' cannot be imported"),
        ("~plant.length", "plant.length is missing"),
    ],
)
def test_options_are_read_off_the_constructor(word: str, said: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        compose(["plant=pendulum", word])
    assert said in str(caught.value)


@pytest.mark.usefixtures("extension")
def test_a_directory_of_yaml_files_is_listed() -> None:
    assert catalogue().summary("plant", "pendulum") == "A pendulum."


def test_a_built_in_name_cannot_be_taken(extension: Path) -> None:
    (extension / "extension-1.0.dist-info" / "entry_points.txt").write_text(
        "[fracctl.plants]\nhcw=extension:Pendulum\n"
    )
    with pytest.raises(ConfigurationError, match="package 'extension' calls one of its plants 'hcw'"):
        registry.load("plants", "hcw")


@pytest.mark.parametrize("kind", sorted(registry.BUILT_IN))
def test_every_built_in_name_stands_for_something(kind: str) -> None:
    for name in registry.BUILT_IN[kind]:
        assert callable(registry.load(kind, name))
