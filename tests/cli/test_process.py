"""The program as a process: start-up, pipes, streams, `python -m`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HEAVY = ("numpy", "scipy", "pandas", "pyarrow", "hydra", "omegaconf", "pydantic", "matplotlib", "rich")


def fracctl(*words: str, **options: object) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "fracctl", *words]
    settings = {"capture_output": True, "text": True, "timeout": 120, "env": environment} | options
    return subprocess.run(command, check=False, **settings)  # type: ignore[call-overload,no-any-return]


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["--version"], ["list"], ["list", "controller"]])
def test_nothing_heavy_is_imported_for_help_and_lists(words: list[str]) -> None:
    script = f"""
import sys
from fracctl.cli.main import main
code = main({words!r})
sys.stderr.write(" ".join(name for name in {HEAVY!r} if name in sys.modules))
sys.exit(code)
"""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, env=environment)
    assert (done.returncode, done.stderr) == (0, "")


def test_python_m_fracctl(tmp_path: Path) -> None:
    done = fracctl("validate", "experiment=outofplane", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        *("list", "list experiments", "list --json", "run experiment=outofplane --cfg job", "show", "show --json"),
        *("run --help", "validate", "completion bash", "completion --complete 'fracctl run '", "reproduce --help"),
    ],
)
def test_a_reader_that_leaves_is_no_error(words: str) -> None:
    command = f"set -o pipefail; '{sys.executable}' -m fracctl {words} | head -1"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0
    assert done.stderr == ""
    assert len(done.stdout.splitlines()) == 1


def test_a_closed_standard_output_is_no_error() -> None:
    command = f"'{sys.executable}' -m fracctl list >&-"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, env=environment)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_under_standard_output_gets_a_sentence() -> None:
    with Path("/dev/full").open("w") as full:
        done = fracctl("list", stdout=full, stderr=subprocess.PIPE, capture_output=False)
    assert done.returncode == 1
    assert done.stderr == "error: No space left on device\n"


def test_a_terminal_without_greek(tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "ascii"}
    done = fracctl("show", env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert "T = 2?" in done.stdout


def test_errors_have_no_traceback() -> None:
    done = fracctl("run", "controller.alpha_w=1.3")
    assert done.returncode == 3
    assert done.stdout == ""
    assert done.stderr == "error: controller.alpha_w = 1.3: must lie in (0, 1]\n"
