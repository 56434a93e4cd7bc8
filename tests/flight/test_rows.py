"""When a flight counts as settled."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.flight import rows
from fracctl.measures import SettlingTimes
from fracctl.plants import HCW

TURN = 2.0 * np.pi


@pytest.mark.parametrize(("horizon", "latest"), [(6.0 * TURN, 5.5 * TURN), (0.5 * TURN, 0.25 * TURN)])
def test_a_band_must_be_kept_for_half_an_orbit_or_half_the_horizon(horizon: float, latest: float) -> None:
    measure = SettlingTimes([100.0, 10.0]).for_flight(HCW(), None)
    times = np.array([0.99 * latest, 1.01 * latest, np.inf])
    found = rows._kept(measure, measure.in_all_units([times, 0.5 * times]), horizon)
    assert found["settling_time_100_m"].tolist() == [times[0], np.inf, np.inf]
    assert found["settling_time_100_m_orbits"].tolist() == [times[0] / TURN, np.inf, np.inf]
    assert np.isinf(found["settling_time_100_m_min"]).tolist() == [False, True, True]
    assert found["settling_time_10_m"].tolist() == (0.5 * times).tolist()


def test_other_measures_stay_as_they_are() -> None:
    columns = {"delta_v_m_s": np.array([1.0, 99.0])}
    assert rows._kept(object(), columns, 1.0) is columns
