"""The repository as a stranger meets it: what is built, what is promised, what must not be there."""

from __future__ import annotations

import ast
import doctest
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

from fracctl.cli.main import main

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

MACHINE_PATHS = r"(?<![\w.~$}])/(?:" + "|".join(["work", "home", "root", "Users", "opt", "mnt"]) + r")/\w"
INDEX_ADDRESSES = "|".join(
    ["pypi" + r"\.org", "python" + r"hosted\.org", "index" + "[-_]url", "find" + "[-_]links", r"/" + r"simple\b"]
)


MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
SHELL = "".join(re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL))
README_COMMANDS = [shlex.split(line, comments=True)[1:] for line in SHELL.splitlines() if line.startswith("fracctl ")]


def tracked_files() -> list[Path]:
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listing.returncode != 0:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listing.stdout.split("\0") if name]


def tracked_text() -> list[tuple[str, str]]:
    texts = [path for path in tracked_files() if path.is_file() and b"\0" not in path.read_bytes()[:8000]]
    return [(str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")) for path in texts]


def make_targets() -> set[str]:
    (phony,) = re.findall(r"^\.PHONY: (.*)$", MAKEFILE, flags=re.MULTILINE)
    targets = set(phony.split())
    assert targets == {target for target in targets if re.search(rf"^{target}:", MAKEFILE, flags=re.MULTILINE)}
    return targets


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    (path,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return zipfile.ZipFile(path)


@pytest.mark.parametrize("pattern", [MACHINE_PATHS, INDEX_ADDRESSES], ids=["machine paths", "package-index addresses"])
def test_nothing_tracked_belongs_to_one_machine(pattern: str) -> None:
    texts = tracked_text()
    assert texts
    assert [f"{name}: {hit[0]}" for name, text in texts for hit in re.finditer(pattern, text)] == []


def test_the_patterns_see_what_they_look_for() -> None:
    for text in ("open('/" + "home/me/x')", "cd /" + "work/main", "see /" + "root/x"):
        assert re.search(MACHINE_PATHS, text)
    for text in ("https://" + "pypi" + ".org/project/x", "pip install --index" + "-url=x"):
        assert re.search(INDEX_ADDRESSES, text)


def test_wheel_holds_configuration_and_types(wheel: zipfile.ZipFile) -> None:
    names = set(wheel.namelist())
    expected = {f"fracctl/{path.relative_to(ROOT)}" for path in (ROOT / "conf").rglob("*.yaml")}
    assert expected
    assert expected <= names
    assert "fracctl/py.typed" in names
    assert not [name for name in names if name.startswith("tests/")]


def test_wheel_holds_every_module(wheel: zipfile.ZipFile) -> None:
    expected = {str(path.relative_to(ROOT)) for path in (ROOT / "fracctl").rglob("*.py")}
    assert expected <= set(wheel.namelist())


def test_wheel_declares_what_the_project_declares(wheel: zipfile.ZipFile) -> None:
    (metadata,) = [wheel.read(name).decode() for name in wheel.namelist() if name.endswith("METADATA")]
    assert f"Version: {PROJECT['version']}\n" in metadata
    assert "License-Expression: BSD-3-Clause\n" in metadata
    assert "fracctl = fracctl.cli.main:main" in "".join(
        wheel.read(name).decode() for name in wheel.namelist() if name.endswith("entry_points.txt")
    )


def test_everything_imported_is_a_declared_dependency() -> None:
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in (ROOT / "fracctl").rglob("*.py")]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    dotted = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    dotted |= {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)}
    imported = {name.split(".")[0] for name in dotted} - sys.stdlib_module_names - {"fracctl"}
    extras = [names for extra, names in PROJECT["optional-dependencies"].items() if extra == "dask"]
    declared = {re.split(r"[<>=]", name)[0] for names in [PROJECT["dependencies"], *extras] for name in names}
    distributions = packages_distributions()
    offered = {name: {name.lower(), *map(str.lower, distributions.get(name, []))} for name in imported}
    assert {name for name in imported if not declared & offered[name]} <= {"pydantic_core"}, "pydantic's other half"


def test_changelog_follows_its_form() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    sections = re.findall(r"^## (.*)$", text, flags=re.MULTILINE)
    assert sections[0] == "[Unreleased]"
    assert all(re.fullmatch(r"\[\d+\.\d+\.\d+\] - \d{4}-\d{2}-\d{2}", section) for section in sections[1:])
    kinds = set(re.findall(r"^### (.*)$", text, flags=re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


@pytest.mark.parametrize("page", ["README.md", "docs/first_hour.md"])
def test_documents_say_how_a_shell_comes_to_know_the_command(page: str, tmp_path: Path) -> None:
    """The line is there before the first command, and works with what `make demo` sets up."""
    text = (ROOT / page).read_text(encoding="utf-8")
    (line,) = dict.fromkeys(re.findall(r"\. \S+/activate", text))
    first = next(re.finditer(r"^```\w+\n(\$ )?fracctl ", text, flags=re.MULTILINE))
    assert text.index(line) < first.start()
    assert "pip install .\n" in text or "pip install . " in text
    assert line.split("/")[0] == f". {re.findall(r'^VENV := (.*)$', MAKEFILE, flags=re.MULTILINE)[0]}"
    if not (Path(sys.prefix) / "bin" / "activate").exists():
        pytest.skip("not in an environment")
    (tmp_path / ".venv").symlink_to(sys.prefix)
    script = f"{line} && command -v fracctl"
    done = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, env={"PATH": "/usr/bin:/bin"}, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr.decode()


def test_dask_is_installed_before_it_is_started() -> None:
    before = README.partition("\ndask scheduler")[0]
    assert "pip install '.[dask]'" in before
    assert "dask" in PROJECT["optional-dependencies"]


@pytest.mark.parametrize("key", ["version", "version_info"])
def test_make_takes_no_other_interpreter_than_the_one_named(key: str, tmp_path: Path) -> None:
    if shutil.which("make") is None:
        pytest.skip("needs make")
    shutil.copy(ROOT / "Makefile", tmp_path)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHON", "MAKEFLAGS")}

    def make(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["make", "--dry-run", *words], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )

    named, own = f"PYTHON={sys.executable}", ".".join(map(str, sys.version_info[:2]))
    assert f"{sys.executable} -m venv .venv" in make(named, "lint").stdout, "there is none yet"
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    (tmp_path / ".venv" / "bin" / "python").touch()
    for version, code in ((f"{own}.0", 0), ("3.99.1", 2)):
        (tmp_path / ".venv" / "pyvenv.cfg").write_text(f"home = x\n{key} = {version}\n", encoding="utf-8")
        assert make("lint").returncode == 0
        assert make(named, "clean").returncode == 0
        done = make(named, "lint")
        assert done.returncode == code, done.stderr
    assert f".venv has Python 3.99, but {sys.executable} is {own}; run 'make clean' first" in done.stderr


def test_documents_name_targets_that_exist() -> None:
    targets = make_targets()
    for name in ("README.md", "CONTRIBUTING.md", ".ci/run"):
        text = (ROOT / name).read_text(encoding="utf-8")
        mentioned = set(re.findall(r"(?:^|`)make (?:[A-Z]+=\S+ )?([a-z-]+)", text, flags=re.MULTILINE))
        assert mentioned <= targets, name


@pytest.mark.parametrize(
    "name",
    [
        "README.md",
        "docs/tutorial.md",
        "docs/own_plant.md",
        "docs/monte_carlo.md",
        "docs/reading_tables.md",
        "docs/contour.md",
        "docs/volterra.md",
        "docs/collocation.md",
        "docs/time_delayed_feedback.md",
        "docs/method_of_steps.md",
        "docs/fractional_memory.md",
        "docs/tether.md",
        "docs/implicit_memory.md",
        "docs/margins.md",
        "docs/sampled_law.md",
        "docs/flight.md",
    ],
)
def test_documents_show_what_comes_out(name: str) -> None:
    failures, tests = doctest.testfile(str(ROOT / name), module_relative=False)
    assert tests > 5
    assert failures == 0


@pytest.mark.parametrize("command", README_COMMANDS)
def test_commands_of_the_readme_are_valid(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    if command[0] != "init":
        assert main(["init", "my_study"]) == 0
    compose_only = ["--cfg", "job"] if command[0] == "run" else []
    assert main([word for word in command if word != "--json"] + compose_only) == 0, capsys.readouterr().err


@pytest.mark.slow
def test_the_first_run_prints_what_the_readme_prints(tmp_path: Path) -> None:
    (shown,) = re.findall(r"```console\n\$ make demo\n(.*?)…", README, flags=re.DOTALL)
    program = [sys.executable, "-c", "import sys; from fracctl.cli.main import main; sys.exit(main())"]
    command = [*program, "run", "experiment=ic1_outofplane", f"output_dir={tmp_path}"]
    printed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert printed.startswith(shown)
    run_directory = Path(printed.splitlines()[-1])
    assert run_directory.parent == tmp_path / "ic1_outofplane"
    named = set(re.findall(r"`([\w.]+\.(?:json|parquet|log|sha256))`", README))
    assert named <= {path.name for path in run_directory.iterdir()}
    assert {path.suffix for path in (run_directory / "figures").iterdir()} == {".pdf", ".png", ".csv"}


def test_documents_name_files_that_exist() -> None:
    for name in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        links = [link for link in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in link]
        assert [link for link in links if not (ROOT / link).exists()] == [], name
