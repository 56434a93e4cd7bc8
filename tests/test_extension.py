"""The example extension: built, installed and used as its author would, and printed in the documentation as it is."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "tests" / "example_extension"
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
SMALL = ["survey.axes.tilt_theta=[0.1,0.3]", "survey.axes.k_t_theta=[2.0,4.0]"]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory that the example package is installed to, built in a copy of its folder."""
    folder = tmp_path_factory.mktemp("extension")
    shutil.copytree(EXAMPLE, folder / "source", ignore=shutil.ignore_patterns("__pycache__"))
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-build-isolation", "--no-deps", "--no-index"]
    subprocess.run([*install, "--target", str(folder / "site"), str(folder / "source")], check=True)
    return folder / "site"


class Shell:
    """Runs `fracctl` with the extension installed, in a folder of its own."""

    def __init__(self, site: Path, folder: Path) -> None:
        paths = [str(site), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        self._environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
        self._folder = folder

    def __call__(self, *words: str, code: int = 0) -> str:
        command = [sys.executable, "-m", "fracctl", *words]
        done = subprocess.run(
            command, cwd=self._folder, env=self._environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == code, done.stderr
        return done.stdout if code == 0 else done.stderr


@pytest.fixture
def fracctl(installed: Path, tmp_path: Path) -> Shell:
    return Shell(installed, tmp_path)


def test_its_experiment_runs(fracctl: Shell) -> None:
    summary = json.loads(fracctl("run", "experiment=pitch_hold", *SMALL, "--json"))
    assert summary["status"] == "finished"
    rows = pd.read_parquet(Path(summary["run_directory"]) / "evaluations.parquet")
    assert rows["time_weighted_error"].between(0.0, 10.0).all()
    best = rows.loc[rows["time_weighted_error"].idxmin()]
    assert summary["optimum"]["k_t_theta"] == best["k_t_theta"] == 4.0
    figures = {path.name for path in (Path(summary["run_directory"]) / "figures").iterdir()}
    assert {"phase.pdf", "phase.png", "phase.csv", "trajectories.pdf"} <= figures


def test_its_law_is_the_one_that_it_says(installed: Path) -> None:
    """With a tilt of 1 it is an integral, which the library's own law has too."""
    program = """
import numpy as np, fracctl as fc
from fracctl_pitch.law import TID
from fracctl_pitch.measure import TimeWeightedError
from fracctl_pitch.plant import GravityGradient
laws = TID(2.0, 0.2, 2.0, tilt=1.0), fc.controllers.PILambdaDMu(0.0, 2.2, 2.0)
plants = GravityGradient(0.5), fc.plants.LinearPlant(-1.5)
own, other = (fc.solve(fc.ClosedLoop(p, law), [0.1, 0.0], 20.0) for p, law in zip(plants, laws))
times = np.linspace(0.0, 20.0, 500)
assert np.abs(own(times) - other(times)).max() < 1e-8
free = fc.solve(fc.ClosedLoop(plants[0], TID(0.0, 0.0, 2.0)), [0.1, 0.0], 20.0)
times = np.linspace(0.0, 20.0, 200001)
exact = np.trapezoid(times * np.abs(free(times)[:, 0]), times)
assert abs(TimeWeightedError()(free)["time_weighted_error"][0] / exact - 1.0) < 1e-5
"""
    environment = {**os.environ, "PYTHONPATH": f"{installed}{os.pathsep}{ROOT}"}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_it_is_listed_shown_and_completed(fracctl: Shell) -> None:
    assert "Pitch of a satellite under the gravity gradient." in fracctl("list", "plant")
    assert "u = -k_t I^tilt x - k_i I x - k_d x'" in fracctl("show", "experiment=pitch_hold")
    assert "plant=gravity_gradient\t" in fracctl("completion", "--complete", "fracctl run plant=gra")
    keys = fracctl("completion", "--complete", "fracctl run experiment=pitch_hold controller.k_")
    assert [line.split("=")[0] for line in keys.splitlines()] == [f"controller.k_{x}_theta" for x in "tid"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["plant.inertia_ratio=2"], "plant.inertia_ratio = 2: must lie in (-1, 1)"),
        (["plant.inertia_rato=0"], "unknown key 'plant.inertia_rato'; did you mean 'plant.inertia_ratio'?"),
        (["controller.tilt_theta=0"], "controller.tilt_theta = 0: must lie in (0, 1]"),
        (["figures.phase.type=phase_plain"], "did you mean 'phase_plane'?"),
    ],
)
def test_mistakes_are_told_as_for_built_in_parts(fracctl: Shell, words: list[str], said: str) -> None:
    assert said in fracctl("validate", "experiment=pitch_hold", *words, code=3)


def test_a_change_of_its_code_is_another_run(installed: Path, tmp_path: Path) -> None:
    site = tmp_path / "site"
    shutil.copytree(installed, site)
    shell = Shell(site, tmp_path)
    before = json.loads(shell("show", "experiment=pitch_hold", "--json"))["run_directory"]
    plain = json.loads(shell("show", "--json"))["run_directory"]
    plant = site / "fracctl_pitch" / "plant.py"
    plant.write_text(plant.read_text().replace("-3.0 *", "-2.9 *"))
    assert json.loads(shell("show", "experiment=pitch_hold", "--json"))["run_directory"] != before
    assert json.loads(shell("show", "--json"))["run_directory"] == plain


def test_the_page_prints_the_package_as_it_is() -> None:
    blocks = dict(re.findall(r"^`([\w./]+)`:\n\n```\w+\n(.*?)```$", PAGE, flags=re.MULTILINE | re.DOTALL))
    files = {path.relative_to(EXAMPLE).as_posix(): path for path in EXAMPLE.rglob("*") if path.suffix != ".pyc"}
    printed = {name: text for name, text in files.items() if text.is_file() and text.read_text().count("\n") > 1}
    assert {name: text.rstrip() for name, text in blocks.items()} == {
        name: path.read_text(encoding="utf-8").rstrip() for name, path in printed.items()
    }
