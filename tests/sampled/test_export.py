"""Exported controllers: units, files, and C that flies the same trajectory."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from fracctl.arrays import Floats
from fracctl.controllers import PD, PID, LinearLaw, PDAlpha, PDLag
from fracctl.errors import RunError, UnsupportedError
from fracctl.plants import HCW, HCWOutOfPlane, LinearPlant
from fracctl.plants.state import StatePlant
from fracctl.sampled import (
    Exponentials,
    ExportedController,
    Oustaloup,
    SampledLaw,
    Window,
    dimensionless_time,
    export,
    simulate,
)
from fracctl.sampled.propagation import held

PLANT = HCWOutOfPlane()
PERIOD = dimensionless_time(PLANT, 10.0)
SCALES = PLANT.scales
MEASUREMENTS = 2
COUPLED = PDAlpha(
    [[4.1, -1.55, 0.0], [3.15, 0.9, 0.0], [0.0, 0.0, 0.85]],
    [[2.7, 1.05, 0.0], [0.9, 2.05, 0.0], [0.0, 0.0, 2.0]],
    [0.98, 0.9, 0.91],
)
CASES: list[tuple[StatePlant, SampledLaw]] = [
    (PLANT, SampledLaw(PDAlpha(0.85, 2.0, 0.91), Window(159), PERIOD)),
    (PLANT, SampledLaw(PDAlpha(0.85, 2.0, 0.91), Oustaloup(0.01, 1e3, 8), PERIOD)),
    (PLANT, SampledLaw(PDAlpha(0.85, 2.0, 0.91), Exponentials(5.0), PERIOD, feed="velocity")),
    (PLANT, SampledLaw(PID(1.0, 0.2, 2.0, 0.2), Window(2), PERIOD)),
    (PLANT, SampledLaw(PD(0.55, 2.0), Window(2), PERIOD, feed="velocity")),
    (HCW(), SampledLaw(COUPLED, Exponentials(5.0), PERIOD)),
]


def compiled(exported: ExportedController, folder: Path) -> ctypes.CDLL:
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no gcc")
    source = exported.write(folder)[2]
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-shared", "-fPIC"]
    library = folder / "controller.so"
    subprocess.run([compiler, *flags, str(source), "-o", str(library)], check=True)
    return ctypes.CDLL(str(library))


class InC:
    """The compiled controller of one member."""

    def __init__(self, library: ctypes.CDLL, n_states: int, n_controls: int) -> None:
        self._library, self._controls = library, n_controls
        self._state = (ctypes.c_double * max(n_states, 1))()

    def begin(self, y: Floats) -> None:
        self._library.fracctl_init(self._state, (ctypes.c_double * len(y))(*y))

    def step(self, y: Floats) -> Floats:
        u = (ctypes.c_double * self._controls)()
        self._library.fracctl_step(self._state, (ctypes.c_double * len(y))(*y), u)
        return np.array(u)


@pytest.mark.parametrize(("plant", "law"), CASES, ids=lambda x: type(getattr(x, "memory", x)).__name__)
def test_c_answers_as_python_does(plant: StatePlant, law: SampledLaw, tmp_path: Path) -> None:
    exported = export(plant, law)
    controller, m = exported.controller, plant.n_controls
    told = np.random.default_rng(1).standard_normal((400, 1, 2 * m)) * np.repeat([1e4, 10.0], m)
    in_c = InC(compiled(exported, tmp_path), controller.n_states, m)
    in_c.begin(told[0, 0])
    states = controller.start(told[0])
    largest = 0.0
    for y in told:
        states, control = controller.step(states, y)
        found = in_c.step(y[0])
        largest = max(largest, float(np.abs(control).max()))
        np.testing.assert_allclose(found, control[0], rtol=0.0, atol=1e-12 * largest)
    assert largest > 0.0


@pytest.mark.parametrize(("plant", "law"), CASES, ids=lambda x: type(getattr(x, "memory", x)).__name__)
def test_c_flies_the_same_trajectory(plant: StatePlant, law: SampledLaw, tmp_path: Path) -> None:
    """In closed loop, in metres and seconds, against the simulation in the plant's own units."""
    exported = export(plant, law)
    m = plant.n_controls
    assert isinstance(plant, LinearPlant)
    assert plant.scales is not None
    start = np.concatenate([np.linspace(-1e-3, 1e-3, m), np.full(m, 2e-3)])
    flight = simulate(plant, law, start, 500 * law.period)
    transition, input_matrix = held(plant, law.period)
    units = np.repeat([plant.scales.length_m, plant.scales.speed_m_s], m)
    in_c = InC(compiled(exported, tmp_path), exported.controller.n_states, m)
    x = start
    in_c.begin(x * units)
    for k in range(500):
        np.testing.assert_allclose(x, flight.states[k], rtol=0.0, atol=1e-12 * np.abs(flight.states).max())
        u = in_c.step(x * units) / plant.scales.acceleration_m_s2
        x = transition @ x + input_matrix @ u


def test_gains_carry_their_units() -> None:
    exported = export(*CASES[0])
    n = 6.3134e-4
    proportional, derivative = exported.gains
    assert (proportional["unit"], derivative["unit"]) == ("s^-2", "s^-1.09")
    assert proportional["matrix"][0][0] == pytest.approx(-0.85 * n**2, rel=1e-4)
    assert derivative["matrix"][0][0] == pytest.approx(-2.0 * n**1.09, rel=1e-4)
    lag = export(PLANT, SampledLaw(PDLag(1.3, 2.0, 0.22), Window(2), PERIOD)).gains[1]
    assert lag["matrix"][0][0] == pytest.approx(-2.0 * n, rel=1e-4)
    assert lag["time_constants_s"][0] == pytest.approx(0.22 / n, rel=1e-4)


def test_files_hold_the_same_controller(tmp_path: Path) -> None:
    exported = export(*CASES[5])
    exported.write(tmp_path / "new")
    told = json.loads((tmp_path / "new" / "controller.json").read_text(encoding="utf-8"))
    stored = np.load(tmp_path / "new" / "controller.npz")
    a = np.zeros((told["states"], told["states"]))
    a[told["A"]["rows"], told["A"]["columns"]] = told["A"]["values"]
    np.testing.assert_array_equal(a, exported.controller.a.toarray())
    for name, entries in told["A"].items():
        np.testing.assert_array_equal(entries, stored[f"A_{name}"])
    for name in "BCDE":
        np.testing.assert_array_equal(told[name], stored[name])
    assert told["period_s"] == pytest.approx(10.0)
    assert told["components"] == ["u", "v", "w"]
    assert told["measurement"][3] == "u_dot [m/s]"


@pytest.mark.parametrize("law", [PD(0.55, 2.0), PDLag(1.3, 2.0, 0.22)], ids=lambda law: type(law).__name__)
def test_a_constant_gets_its_proportional_share(law: LinearLaw) -> None:
    """100 m at rest: -k_P n² times 100 m, in m/s²."""
    controller = export(PLANT, SampledLaw(law, Window(2), PERIOD)).controller
    y = np.array([[100.0, 0.0]])
    _, control = controller.step(controller.start(y), y)
    share = {"PD": 0.55, "PDLag": 1.3}[type(law).__name__]
    assert control[0, 0] == pytest.approx(-share * 6.3134e-4**2 * 100.0, rel=1e-4)


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match="no units"):
        export(LinearPlant(-1.0), SampledLaw(PD(1.0, 1.0), Window(2), 0.1))
    (tmp_path / "file").write_text("")
    with pytest.raises(RunError, match="cannot write"):
        export(*CASES[4]).write(tmp_path / "file")
