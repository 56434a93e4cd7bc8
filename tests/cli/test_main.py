"""The front door: commands, options, exit codes, help."""

from __future__ import annotations

import pytest

from fracctl.cli.main import COMMANDS, main


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = main(words)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, "--help")
    assert (code, err) == (0, "")
    assert all(f"\n  {name} " in out for name in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_help_of_a_command_shows_examples(capsys: pytest.CaptureFixture[str], command: str, flag: str) -> None:
    code, out, err = run(capsys, command, flag)
    assert (code, err) == (0, "")
    assert f"usage: fracctl {command}" in out
    assert f"  fracctl {command}" in out.partition("examples:")[2]


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "--version")
    assert code == 0
    assert out.startswith("fracctl ")


def test_without_a_command_the_help_goes_to_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys)
    assert (code, out) == (2, "")
    assert "commands:" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["rnu"], "there is no command 'rnu'; did you mean 'run'?"),
        (["fly"], "there is no command 'fly'; commands: run, reproduce, report, list, show, validate"),
        (["experiment=x"], "'experiment=x' is no command; did you mean 'fracctl run experiment=x'?"),
        (["--json"], "option '--json' belongs behind a command, as in 'fracctl run --json'"),
        (["--verison"], "unknown option '--verison'; did you mean '--version'?"),
        (["run", "--jsn"], "unknown option '--jsn'; did you mean '--json'?"),
        (["run", "--multi"], "unknown option '--multi'; did you mean '--multirun'?"),
        (["run", "--quie"], "unknown option '--quie'; did you mean '--quiet'?"),
        (["run", "--config-dri=x"], "unknown option '--config-dri=x'; did you mean '--config-dir'?"),
        (["run", "-x"], "unknown option '-x'"),
        (["run", "--cfg", "all"], "argument --cfg: invalid choice: 'all'"),
        (["run", "--config-dir"], "argument --config-dir: expected one argument"),
        (["run", "foo"], "'foo' is not an override; write KEY=VALUE"),
        (["list", "contoller"], "there is no group 'contoller'; did you mean 'controller'?"),
        (["list", "plant", "solver"], "'list' takes one group"),
        (["list", "runs", "here"], "'list runs' takes output_dir=DIR only"),
        (["validate", "--json"], "unknown option '--json'"),
    ],
)
def test_wrong_command_lines(capsys: pytest.CaptureFixture[str], words: list[str], said: str) -> None:
    code, out, err = run(capsys, *words)
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {said}")
    assert err.count("\n") == 1


@pytest.mark.parametrize("command", ["run", "show", "validate"])
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["controller.alpha_w=1.3"], "controller.alpha_w = 1.3: must lie in (0, 1]"),
        (["controller.alhpa_w=1"], "unknown key 'controller.alhpa_w'; did you mean 'controller.alpha_w'?"),
        (["experiment=nowhere"], "there is no experiment 'nowhere'"),
        (["--config-dir", "nowhere"], "the configuration directory 'nowhere' does not exist"),
        (["name=a", "--config-dir=nowhere", "seed=1"], "the configuration directory 'nowhere' does not exist"),
    ],
)
def test_wrong_configurations(capsys: pytest.CaptureFixture[str], command: str, words: list[str], said: str) -> None:
    code, out, err = run(capsys, command, *words)
    assert (code, out) == (3, "")
    assert err.startswith(f"error: {said}")
    assert err.count("\n") == 1


def test_several_errors_are_several_lines(capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = run(capsys, "validate", "seed=-1", "horizon_periods=0")
    assert code == 3
    assert err.splitlines() == ["error: horizon_periods = 0: must be above 0", "error: seed = -1: must be at least 0"]


@pytest.mark.parametrize("words", [["--debug", "validate", "seed=-1"], ["validate", "seed=-1", "--debug"]])
def test_a_traceback_is_shown_on_request(capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    code, _, err = run(capsys, *words)
    assert code == 3
    assert err.startswith("Traceback (most recent call last):")
    assert err.endswith("error: seed = -1: must be at least 0\n")


@pytest.mark.parametrize(
    "words",
    [
        ["validate", "experiment=outofplane", "--config-dir", "{}", "seed=1"],
        ["validate", "--config-dir={}", "experiment=outofplane", "seed=1"],
        ["validate", "experiment=outofplane", "seed=1", "--config-dir", "{}"],
    ],
)
def test_options_stand_before_or_after_overrides(
    capsys: pytest.CaptureFixture[str], tmp_path_factory: pytest.TempPathFactory, words: list[str]
) -> None:
    directory = str(tmp_path_factory.mktemp("conf"))
    code, out, _ = run(capsys, *(word.replace("{}", directory) for word in words))
    assert code == 0
    assert out == "valid: outofplane, 35301 design points, 3 initial conditions\n"


def test_an_interruption(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(options: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(COMMANDS["list"], "execute", interrupted)
    code, _, err = run(capsys, "list")
    assert code == 130
    assert err == "interrupted; what was computed is kept, and the same command continues\n"


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (PermissionError(13, "Permission denied", "outputs"), "error: Permission denied: 'outputs'\n"),
        (OSError(28, "No space left on device"), "error: No space left on device\n"),
        (ZeroDivisionError("x"), "error: ZeroDivisionError: x (a fault of fracctl; --debug shows where)\n"),
    ],
)
def test_what_nobody_foresaw(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, error: Exception, said: str
) -> None:
    def fails(options: object) -> int:
        raise error

    monkeypatch.setattr(COMMANDS["list"], "execute", fails)
    code, out, err = run(capsys, "list")
    assert (code, out, err) == (1, "", said)
