"""The wheel, installed into an empty environment and used in an empty directory."""

from __future__ import annotations

import os
import site
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

from fracctl.reproduction.suites import read_suite, suite_names

ROOT = Path(__file__).parents[1]
SMALL_GRID = ["survey.axes.alpha_w=[0.91,1.0]", "survey.axes.k_p_w=[0.55,0.85]", "survey.axes.k_d_w=2"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    (path,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return Path(path)


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment that holds the wheel; its dependencies are borrowed from the tests' own.

    A line of a .pth file adds their directory behind the environment's, without following the .pth files in there:
    an editable installation of the project stays out of sight.
    """
    environment = tmp_path_factory.mktemp("environment")
    venv.create(environment, with_pip=False)
    python = environment / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*install, str(wheel)], check=True)
    packages = sysconfig.get_path("purelib", vars={"base": str(environment)})
    (Path(packages) / "borrowed.pth").write_text("\n".join(site.getsitepackages()) + "\n", encoding="utf-8")
    return environment / "bin"


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in [name for name in os.environ if name.startswith(("PYTHON", "VIRTUAL_ENV"))]:
        monkeypatch.delenv(name)
    return tmp_path


def printed(*command: str | Path) -> str:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def test_the_wheel_holds_the_published_tables(wheel: Path) -> None:
    files = {path.relative_to(ROOT) for path in (ROOT / "experiments").rglob("*") if path.is_file()}
    assert {Path("experiments") / name / "published.csv" for name in suite_names()} <= files
    assert {f"fracctl/{path.as_posix()}" for path in files} <= set(zipfile.ZipFile(wheel).namelist())


@pytest.mark.slow
def test_everything_is_found_inside_the_environment(installed: Path, empty: Path) -> None:
    program = (
        "import fracctl, fracctl.config.catalogue as c, fracctl.reproduction.suites as s; "
        "print(fracctl.__file__, c.built_in_directory(), s.suites_directory(), sep='\\n')"
    )
    paths = [Path(line) for line in printed(installed / "python", "-c", program).splitlines()]
    assert all(path.is_relative_to(installed.parent) for path in paths), paths
    assert [path.name for path in paths] == ["__init__.py", "conf", "experiments"]
    assert not any(empty.iterdir())


@pytest.mark.slow
def test_an_experiment_runs(installed: Path, empty: Path) -> None:
    lines = printed(installed / "fracctl", "run", "experiment=ic1_outofplane", *SMALL_GRID).splitlines()
    assert lines[3].split()[:5] == ["ic1", "optimum", "0.91", "0.85", "2"]
    assert Path(lines[-1]).parent == empty / "outputs" / "ic1_outofplane"
    assert (Path(lines[-1]) / "figures" / "trajectories.pdf").is_file()
    assert [path.name for path in empty.iterdir()] == ["outputs"]


@pytest.mark.slow
def test_the_papers_are_reproduced(installed: Path, empty: Path) -> None:
    text = printed(installed / "fracctl", "reproduce")
    for paper in suite_names():
        for section in read_suite(paper).sections:
            folder = empty / "outputs" / "reproduce" / paper / section
            assert str(folder) in text.splitlines()
            assert {path.name for path in folder.iterdir()} == {"table.csv", "table.md", "table.parquet"}
    assert "51 rows: 50 reproduced, 1 not reproduced, 0 not decidable" in text
