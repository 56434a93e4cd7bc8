"""References of laws that are sums of actions against those of PD^α, and against matrix exponentials."""

from __future__ import annotations

import numpy as np
import pytest

from tests.references import loops
from tests.references.laplace import Reference
from tests.references.laws import ActedLoop, Action
from tests.systems.laws import IN_PLANE, filtered_pid, pid

GAINS = [[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]]
START = [-1e-3, 2e-3, 1e-3, 2e-3]
K_I = np.array([[0.2, -0.1], [0.3, 0.1]])
LAG = (0.2, 0.1)


@pytest.mark.parametrize("time", [0.01, 1.0, 12.0])
def test_pd_alpha(time: float) -> None:
    loop = loops.in_plane(GAINS, [0.97, 0.9], START)
    acted = ActedLoop(*IN_PLANE, [Action(loop.k_p, (0.0, 0.0)), Action(loop.k_d, (0.97, 0.9))], START)
    exact = Reference(loop, 25).digits_at([time])
    np.testing.assert_allclose(acted.at(time), [*exact.position[0], *exact.control[0]], rtol=1e-14)


@pytest.mark.parametrize("time", [0.01, 1.0, 12.0])
def test_laws_of_integer_order(time: float) -> None:
    k_p, k_d = np.hsplit(np.array(GAINS), 2)
    common = [Action(k_p, (0.0, 0.0)), Action(K_I, (-1.0, -1.0))]
    for last, form in [
        (Action(k_d, (1.0, 1.0)), pid(*IN_PLANE, k_p, K_I, k_d)),
        (Action(k_d, time_constants=LAG), filtered_pid(*IN_PLANE, k_p, K_I, k_d, LAG)),
    ]:
        states = form.states(np.array(START), np.array([time]))[0]
        exact = [*states[:2], *(form.output @ states)]
        np.testing.assert_allclose(ActedLoop(*IN_PLANE, [*common, last], START).at(time), exact, rtol=1e-11)
