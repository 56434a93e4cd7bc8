"""The table of the ideal law and its implementations."""

from __future__ import annotations

import numpy as np
import pytest

import fracctl as fc
from fracctl.controllers import PDAlpha, Saturation
from fracctl.errors import UnsupportedError
from fracctl.plants import HCWOutOfPlane
from fracctl.sampled import Exponentials, SampledLaw, Window, compare

PLANT = HCWOutOfPlane()
LAW = PDAlpha(0.85, 2.0, 0.91)
ORBIT = 2.0 * np.pi


def test_the_ideal_law_and_two_implementations() -> None:
    laws = {
        "modes": SampledLaw(LAW, Exponentials(20.0), 1e-3),
        "short": SampledLaw(LAW, Window(160), 6.313e-3),
    }
    ideal, modes, short = compare(fc.ClosedLoop(PLANT, LAW), laws, [0.0, 0.002], 4.0 * np.pi, [1e-5, 1e-6])
    assert [row.name for row in (ideal, modes, short)] == ["ideal", "modes", "short"]
    assert ideal.settling_times[0] / ORBIT == pytest.approx(0.4795, abs=1e-4)
    assert modes.settling_times[0] == pytest.approx(ideal.settling_times[0], rel=2e-3)
    assert short.settling_times[0] / ORBIT == pytest.approx(0.548, abs=1e-3)
    assert ideal.delta_v_m_s == pytest.approx(16.7, abs=0.05)
    assert modes.delta_v == pytest.approx(ideal.delta_v, rel=2e-3)
    assert modes.margins.phase_margin_deg == pytest.approx(71.28, abs=0.15)
    assert (ideal.states, ideal.operations, ideal.control_deviation) == (None, None, 0.0)
    assert (short.states, short.operations) == (159, 160)
    assert modes.control_deviation < 0.01 < short.control_deviation < 0.05


def test_a_limited_loop_is_refused() -> None:
    loop = fc.ClosedLoop(PLANT, LAW, Saturation(1.0))
    with pytest.raises(UnsupportedError, match="without limits"):
        compare(loop, {}, [0.0, 0.002], 1.0, [1e-5])
