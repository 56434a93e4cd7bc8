"""Words completed in bash, zsh and fish, and what they are made of."""

from __future__ import annotations

import os
import pty
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from fracctl.cli.candidates import FILES, candidates, split
from fracctl.cli.main import COMMANDS, main
from fracctl.config.catalogue import catalogue
from fracctl.config.compose import compose
from fracctl.config.keys import dotted, settings

PROGRAM = f"""#!{sys.executable}
import sys
from fracctl.cli.main import main
sys.exit(main())
"""
PATIENCE_S = 60.0
"""For a shell on a busy machine."""


def words(line: str) -> list[str]:
    return [word for word, _ in candidates(line, COMMANDS)]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("fracctl rep", ["report", "reproduce"]),
        ("fracctl run --mul", ["--multirun"]),
        ("fracctl run --cfg ", ["job"]),
        ("fracctl run --config-dir ", [FILES]),
        ("fracctl --ver", ["--version"]),
        ("fracctl list experim", ["experiments"]),
        ("fracctl completion z", ["zsh"]),
        ("fracctl export --memory wi", ["window"]),
        ("fracctl reproduce fractional_hcw/out", ["fractional_hcw/out_of_plane"]),
        ("fracctl run experiment=ic1_outo", ["experiment=ic1_outofplane"]),
        ("fracctl run -m experiment=ic1_outofplane,ic2_outo", ["experiment=ic1_outofplane,ic2_outofplane"]),
        ("fracctl run 'initial_condition=[ic1,ic2_e", ["initial_condition=[ic1,ic2_elements"]),
        ("fracctl run plant.ch", ["plant.chief."]),
        ("fracctl run plant.chief.alt", ["plant.chief.altitude_km="]),
        ("fracctl run plant=tether plant.chief.", []),
        ("fracctl run ~controller.k_p", ["~controller.k_p_w"]),
        ("fracctl run experiment=inplane controller.alpha_", ["controller.alpha_u=", "controller.alpha_v="]),
        ("fracctl run experiment=inplane objective=st_", ["objective=st_os", "objective=st_u"]),
        ("fracctl run survey=out_of_plane_gains survey.axes.al", ["survey.axes.alpha_w="]),
        ("fracctl run solver.type=me", ["solver.type=method_of_steps"]),
        ("fracctl run initial_condition=ic1_elements initial_condition.ic1_elements.lin", None),
        ("fracctl fly ", []),
    ],
)
def test_what_words_may_become(line: str, expected: list[str] | None) -> None:
    found = words(line)
    if expected is None:
        assert found == ["initial_condition.ic1_elements.linearised="]
    else:
        assert sorted(found) == sorted(expected)


def test_options_come_with_their_meaning() -> None:
    (found,) = candidates("fracctl run experiment=ic1_outo", COMMANDS)
    assert found[1].startswith("Fastest settling out of plane from IC1")


def test_quotes_are_taken_off() -> None:
    assert split("fracctl run 'a b' \"c") == (["fracctl", "run", "a b"], "c")
    assert split("fracctl run ") == (["fracctl", "run"], "")


def test_a_directory_of_ones_own_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "plant").mkdir()
    (tmp_path / "plant" / "moonlet.yaml").write_text("# A moonlet.\ntype: hcw\nmoon: 1\n")
    assert words(f"fracctl run --config-dir {tmp_path} plant=moon") == ["plant=moonlet"]
    assert words(f"fracctl run --config-dir={tmp_path} plant=moonlet plant.m") == ["plant.moon="]
    assert words("fracctl run plant=moon") == []
    monkeypatch.setenv("FRACCTL_CONFIG_DIR", str(tmp_path))
    assert words("fracctl run plant=moon") == ["plant=moonlet"]


def test_studies_of_the_directory_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "mine"]) == 0
    assert words("fracctl run mi") == ["mine"]
    assert words("fracctl run mine evaluation.laws.pd_") == ["evaluation.laws.pd_alpha.", "evaluation.laws.pd_lag."]
    assert "evaluation.laws.pd_alpha.values.k_d_uv=" in words("fracctl run mine evaluation.laws.pd_alpha.values.")


@pytest.mark.parametrize("experiment", catalogue().options("experiment"))
def test_keys_are_those_of_the_composed_run(experiment: str) -> None:
    """Read off the files without composing, they are keys that composing knows; only null may stand for more."""
    chosen = [f"experiment={experiment}"]
    composed = dict(dotted(compose(chosen).model_dump(mode="json")))
    known = {".".join(key.split(".")[:end]) for key in composed for end in range(1, key.count(".") + 2)}
    offered = {key for key, _ in dotted(settings(catalogue(), chosen))}
    assert len(offered) > 20
    assert {key for key in offered - known if not key.startswith("evaluation.dispersions.")} == set()


def test_a_wrong_file_completes_nothing_and_says_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for line in (f"fracctl run --config-dir {tmp_path / 'none'} plant=", "fracctl run experiment=none plant.ch"):
        assert main(["completion", "--complete", line]) == 0
    captured = capsys.readouterr()
    assert (captured.out.split(), captured.err) == (["plant.chief."], "")


def test_completing_loads_nothing_heavy() -> None:
    program = (
        "import sys; from fracctl.cli.main import main; main(['completion', '--complete', 'fracctl run plant.']); "
        "print(sorted({'numpy', 'hydra', 'pydantic', 'scipy', 'pandas', 'omegaconf'} & set(sys.modules)))"
    )
    printed = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert printed.splitlines()[-1] == "[]"


@pytest.fixture
def path(tmp_path: Path) -> str:
    """A PATH on which `fracctl` is the one that is tested."""
    program = tmp_path / "bin" / "fracctl"
    program.parent.mkdir()
    program.write_text(PROGRAM)
    program.chmod(0o755)
    return f"{program.parent}{os.pathsep}{os.environ['PATH']}"


class Terminal:
    """A shell that somebody types into."""

    def __init__(self, command: list[str], environment: Mapping[str, str], folder: Path) -> None:
        self._shown = ""
        self._process, self._screen = pty.fork()
        if self._process == 0:
            os.chdir(folder)
            os.execvpe(command[0], command, dict(environment))

    def type(self, text: str, until: str) -> str:
        """Return what the screen shows from now on, up to a text."""
        self._shown = ""
        os.write(self._screen, text.encode())
        deadline = time.monotonic() + PATIENCE_S
        while until not in self._shown:
            ready, _, _ = select.select([self._screen], [], [], max(0.0, deadline - time.monotonic()))
            assert ready, f"the screen shows {self._shown!r}, but never {until!r}"
            self._shown += os.read(self._screen, 65536).decode(errors="replace")
        return self._shown

    def close(self) -> None:
        os.close(self._screen)
        os.waitpid(self._process, 0)


def shell(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"needs {name}, the Debian package of this name")
    return found


STARTS = {
    "bash": (["--norc", "--noprofile", "-i"], "source <(fracctl completion bash)"),
    "zsh": (["-f", "-i"], "autoload -Uz compinit && compinit -u -D && source <(fracctl completion zsh)"),
}


@pytest.fixture(params=sorted(STARTS))
def terminal(request: pytest.FixtureRequest, path: str, tmp_path: Path) -> Iterator[Terminal]:
    flags, source = STARTS[request.param]
    kept = {name: os.environ[name] for name in ("PYTHONPATH", "LANG") if name in os.environ}
    environment = {"PATH": path, "TERM": "dumb", "PS1": "", "HOME": str(tmp_path), **kept}
    opened = Terminal([shell(request.param), *flags], environment, tmp_path)
    opened.type(f"{source}; echo rea''dy\n", until="ready")
    yield opened
    opened.close()


@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        ("fracctl vali", "validate "),
        ("fracctl run experiment=ic1_outo", "ic1_outofplane "),
        ("fracctl run -m experiment=ic1_outofplane,ic2_outo", "ic2_outofplane "),
        ("fracctl run plant=hcw plant.chief.alt", "altitude_km="),
        ("fracctl run --fr", "--fresh "),
        ("fracctl run --config-dir mi", "mine/"),
    ],
)
def test_a_tab_completes_in_bash_and_zsh(terminal: Terminal, tmp_path: Path, typed: str, completed: str) -> None:
    (tmp_path / "mine").mkdir()
    terminal.type(typed, until=typed[-3:])
    terminal.type("\t", until=completed[len(_shared(typed, completed)) :].strip())


def _shared(typed: str, completed: str) -> str:
    """What of the completed word is typed already."""
    return next(completed[:n] for n in range(len(completed), -1, -1) if typed.endswith(completed[:n]))


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("fracctl vali", ["validate"]),
        ("fracctl run experiment=ic1_outo", ["experiment=ic1_outofplane"]),
        ("fracctl run -m experiment=ic1_outofplane,ic2_outo", ["experiment=ic1_outofplane,ic2_outofplane"]),
        ("fracctl run plant.chief.alt", ["plant.chief.altitude_km="]),
        ("fracctl run --fr", ["--fresh"]),
        ("fracctl run --config-dir mi", ["mine/"]),
    ],
)
def test_fish_completes(path: str, tmp_path: Path, typed: str, expected: list[str]) -> None:
    (tmp_path / "mine").mkdir()
    program = f"fracctl completion fish | source; complete -C '{typed}'"
    environment = {**os.environ, "PATH": path, "HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
    command = [shell("fish"), "--no-config", "-c", program]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert [line.split("\t")[0] for line in done.stdout.splitlines()] == expected
