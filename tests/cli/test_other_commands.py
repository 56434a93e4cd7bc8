"""`fracctl list`, `show` and `validate`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fracctl.cli.main import main
from fracctl.config.catalogue import built_in_directory
from fracctl.store.lock import exclusive

EXPERIMENTS = built_in_directory() / "experiment"


def lines(capsys: pytest.CaptureFixture[str], *words: str) -> list[str]:
    assert main(words) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out.splitlines()


def test_list_names_experiments_and_groups(capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(lines(capsys, "list"))
    assert "ic1_outofplane" in text
    solvers = "collocation, contour, explicit_memory, implicit_memory, method_of_steps, volterra"
    assert f"  solver             {solvers}" in text


@pytest.mark.parametrize("word", ["experiments", "experiment"])
def test_list_experiments(capsys: pytest.CaptureFixture[str], word: str) -> None:
    found = lines(capsys, "list", word)
    assert [line.split()[0] for line in found] == sorted(path.stem for path in EXPERIMENTS.glob("*.yaml"))
    assert sum("Fastest settling out of plane from IC1" in line for line in found) == 1


def test_list_shows_files_of_ones_own(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "experiment" / "campaign").mkdir(parents=True)
    (tmp_path / "experiment" / "campaign" / "one.yaml").write_text("# fracctl run experiment=campaign/one\n# First.\n")
    found = lines(capsys, "list", "experiments", "--config-dir", str(tmp_path))
    assert found[0].split() == ["campaign/one", "First"]
    assert lines(capsys, "validate", "experiment=campaign/one", "--config-dir", str(tmp_path))


def test_list_runs(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["list", "runs"]) == 0
    assert capsys.readouterr().err == "no runs below 'outputs'\n"
    for name, started, content in (
        ("b", "2026-01-02", {"status": "finished", "summary": {"optimum": {"objective": 3.0127612}}}),
        ("a", "2026-01-01", {"status": "running", "summary": None}),
    ):
        (tmp_path / "work" / name / "0123").mkdir(parents=True)
        content |= {"configuration": {"objective": "settling_time"}, "provenance": {"started": started}}
        (tmp_path / "work" / name / "0123" / "run.json").write_text(json.dumps(content))
    with exclusive(tmp_path / "work" / "a" / ".0123.lock"):
        assert lines(capsys, "list", "runs", "output_dir=work")[1].split()[2] == "running"
    (tmp_path / "work" / "a" / "broken").mkdir()
    (tmp_path / "work" / "a" / "broken" / "run.json").write_text("{")
    found = [line.split() for line in lines(capsys, "list", "runs", "output_dir=work")]
    assert found[0] == ["age", "status", "result", "directory"]
    assert [line[1] for line in found[1:]] == ["days", "days"]
    assert [line[2:] for line in found[1:]] == [
        ["stopped", "work/a/0123"],
        ["finished", "settling_time", "3.01276", "work/b/0123"],
    ]
    plain = [json.loads(line) for line in lines(capsys, "list", "runs", "output_dir=work", "--json")]
    assert [run["value"] for run in plain] == [None, 3.0127612]
    assert plain[0] == {
        "directory": "work/a/0123",
        "experiment": "a",
        "run_id": "0123",
        "status": "stopped",
        "failed_points": 0,
        "laws": [],
        "started": "2026-01-01",
        "objective": "settling_time",
        "value": None,
        "error": None,
    }


def test_show_speaks_in_units(capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(lines(capsys, "show", "experiment=outofplane"))
    for part in (
        "one period T = 2π = 2.76445 h",
        "w_dot = 0.002 (12.627 m/s)",
        "threshold 1e-05 (100 m)",
        "35301 design points, 3 initial conditions",
        "alpha_w from 0.8 to 1, 21 values",
        "compared with the best point of alpha_w = 1",
        "st_os_u = (settling_time · overshoot · control_effort)^(1/3)",
        "υ = -K_P ξ - K_D D^α ξ",
    ):
        assert part in text


@pytest.mark.parametrize("name", ["tether", "tether_monte_carlo", "tether_orders", "nonlinear_ic1", "ic1_bands"])
def test_show_explains_every_kind_of_run(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(lines(capsys, "show", f"experiment={name}"))
    assert text.startswith(name)
    assert ("FDA-SMC, alpha_1 0.5, phi_2 0.0054" in text) is (name in ("tether", "tether_monte_carlo"))
    assert ("samples 200" in text) is (name == "tether_monte_carlo")


def test_show_says_what_a_search_does(capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(lines(capsys, "show", "experiment=ic1_inplane"))
    for part in (
        "continuation: 442 searches, 1 initial condition",
        "Searches for the best gains at every order, outward from a start",
        "first_steps [0.1, 0.05], steps [0.05], bounds [-8, 8], lqr (q 1, r 1, round_to 0.05)",
        "alpha_v from 0.9 to 1, 11 values",
        "the best point is kept for each alpha_u and alpha_v",
        "compared with the best point of alpha_u = 1, alpha_v = 1",
    ):
        assert part in text
    assert lines(capsys, "validate", "experiment=inplane") == ["valid: inplane, 1326 searches, 3 initial conditions"]


def test_show_says_what_optima_must_keep_to(capsys: pytest.CaptureFixture[str]) -> None:
    limits = ['constraints.phase_margin_deg=">= 60"', 'constraints.noise_gain="<= 400"']
    text = "\n".join(lines(capsys, "show", "experiment=ic1_margins", *limits))
    for part in (
        "stability_margins: Gain, phase and delay that bring a pole to the imaginary axis",
        "noise_gain, sample_period_s 10",
        "optima have  phase_margin_deg >= 60\n",
        "noise_gain <= 400\n",
    ):
        assert part in text


def test_show_without_units(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["plant=linear", "controller=pd_alpha_own", "initial_condition=own", "initial_condition.own.x=1"]
    text = "\n".join(lines(capsys, "show", *words))
    assert "dimensionless; T = 2π" in text
    assert "own: x = 1" in text


def test_show_tells_where_delays_come_from(capsys: pytest.CaptureFixture[str]) -> None:
    text = "\n".join(lines(capsys, "show", "experiment=formation"))
    assert "delay        6.28319 = 1 T = 1.51607 h, the period of the plant" in text
    assert "formation_2_km: x = 0.000298507 (2000 m), y_dot = -0.000597015 (-4.60486 m/s)" in text
    text = "\n".join(lines(capsys, "show", "experiment=ellipsoid"))
    assert "delay        the first return of the free motion" in text
    assert "rho_1_9: 3.10656 = 0.494424 T = 2.60574 h" in text
    assert "delay = " not in text
    assert "largest_by" not in text


def test_show_names_the_directory_that_a_run_would_have(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    found = lines(capsys, "show", f"output_dir={tmp_path}")
    assert found[-1].split()[-1].startswith(f"{tmp_path}/custom/")


def test_validate_a_configuration(capsys: pytest.CaptureFixture[str]) -> None:
    assert lines(capsys, "validate") == ["valid: custom, 1 design point, 1 initial condition"]


def test_show_gives_fractional_gains_their_unit(capsys: pytest.CaptureFixture[str]) -> None:
    """2 n^1.09 at n = 6.3135e-4 rad/s and α = 0.91; integer orders have none."""
    assert main(["show", "controller.alpha_w=0.91"]) == 0
    assert "k_d_w is 0.000650614 s^(-1.09) in SI units" in capsys.readouterr().out
    assert main(["show"]) == 0
    assert "SI units" not in capsys.readouterr().out
