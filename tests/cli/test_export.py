"""`fracctl export`: files of a controller, and what cannot be exported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fracctl.cli.main import main
from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.flight import FlightEvaluation

FLIGHTS = ["experiment=flight_ic1", "evaluation.period_s=20", "horizon_periods=1"]
IC1 = ["controller.alpha_w=0.91", "controller.k_p_w=0.85"]


def exported(folder: Path, *words: str) -> dict[str, object]:
    assert main(["export", "--to", str(folder), *words]) == 0
    found: dict[str, object] = json.loads((folder / "controller.json").read_text(encoding="utf-8"))
    return found


def test_it_writes_three_files_and_says_where(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = exported(tmp_path / "out", *IC1)
    lines = capsys.readouterr().out.splitlines()
    assert lines[-3:] == [str(tmp_path / "out" / f"controller.{suffix}") for suffix in ("json", "npz", "c")]
    assert all(Path(line).is_file() for line in lines[-3:])
    assert lines[1] == f"{told['states']} states, {told['operations']} multiply-adds a step"
    assert any(line.endswith("s^-1.09") for line in lines)
    assert told["period_s"] == pytest.approx(10.0)


def test_options_reach_the_controller(tmp_path: Path) -> None:
    words = ["--period-s", "5", "--delay", "0.5", "--memory", "window", "--samples", "318", *IC1]
    told = exported(tmp_path, *words)
    assert (told["states"], told["period_s"], told["delay_s"]) == pytest.approx((317, 5.0, 2.5))
    gains = np.load(tmp_path / "controller.npz")
    assert gains["B"].shape == (317, 2)
    fed = exported(tmp_path, "--feed", "velocity", "controller=pd")
    assert fed["states"] == 0


def test_a_run_of_flights_exports_the_controller_that_flies(tmp_path: Path) -> None:
    flights = build_checked(compose(FLIGHTS))[0]
    assert isinstance(flights, FlightEvaluation)
    told: Any = exported(tmp_path, "--law", "published_pd_alpha", *FLIGHTS)
    assert (told["period_s"], told["delay_s"]) == pytest.approx((20.0, 4.0))
    assert told["description"].endswith("fed by velocity, every 20 s")
    flight = flights.fly("ic1", "sampled", design={"law_number": list(flights.laws).index("published_pd_alpha")})
    n, scales = told["states"], flights.plant.scales
    a = np.zeros((n, n))
    a[told["A"]["rows"], told["A"]["columns"]] = told["A"]["values"]
    b, c, d, e = (np.array(told[name]) for name in "BCDE")
    units = np.repeat([scales.length_m, scales.speed_m_s], 3)
    state = e @ (flight.at_samples[0, 0] * units)
    for measured, command in zip(flight.at_samples[0, :200] * units, flight.commands[0], strict=False):
        control = c @ state + d @ measured
        np.testing.assert_allclose(control / scales.acceleration_m_s2, command, rtol=1e-9, atol=1e-12)
        state = a @ state + b @ measured


def test_options_win_over_the_flights(tmp_path: Path) -> None:
    words = ["--law", "published_pd_alpha", *FLIGHTS, "--period-s", "40", "--delay", "0", "--feed", "position"]
    told: Any = exported(tmp_path, *words, "--memory", "window", "--samples", "12")
    assert (told["period_s"], told["delay_s"], told["states"]) == pytest.approx((40.0, 0.0, 3 * 11))
    short = [*FLIGHTS, "evaluation.memory=window", "evaluation.memory_samples=12", "--law", "published_pd_alpha"]
    assert exported(tmp_path, *short)["states"] == 3 * 11
    assert exported(tmp_path, *short, "--memory", "exponentials")["states"] != 3 * 11


def test_the_regulator_has_its_gains(tmp_path: Path) -> None:
    told = exported(tmp_path, "controller=lqr")
    assert len(told["law"]) == 2  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        ([], 2, "--to"),
        (["--to", "x", "--period-s", "0"], 2, "--period-s must be positive, but is 0.0"),
        (["--to", "x", "--delay", "-1", *IC1], 2, "--delay must not be negative"),
        (["--to", "x", "--tolerance", "2", *IC1], 2, "--tolerance must lie in (0, 1), but is 2.0"),
        (["--to", "x", "--memory", "window", "--samples", "1", *IC1], 2, "--samples must be at least 2, but is 1"),
        (["--to", "x", "--samples", "9"], 2, "--samples goes with memory = window"),
        (["--to", "x", *FLIGHTS], 2, "several laws; say which by --law: published_pd, published_pd_alpha, pd, "),
        (["--to", "x", *FLIGHTS, "--law", "pd_lak"], 2, "did you mean 'pd_lag'?"),
        (["--to", "x", "--law", "pd", *IC1], 2, "--law goes with several laws that fly, but is pd"),
        (["--to", "x", "experiment=formation"], 3, "delayed states"),
        (["--to", "x", "experiment=tether"], 3, "nonlinear law with memory"),
        (["--to", "x", "experiment=nonlinear_ic1"], 3, "--memory window --samples M"),
        (["--to", "x", "controller.k_p_w=0", "controller.k_d_w=0"], 3, "all gains of the controller are 0"),
    ],
)
def test_refusals(words: list[str], code: int, sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", *words]) == code
    captured = capsys.readouterr()
    assert sentence in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_a_folder_that_cannot_be_written_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("")
    assert main(["export", "--to", str(tmp_path / "file"), *IC1]) == 1
    assert "cannot write" in capsys.readouterr().err
