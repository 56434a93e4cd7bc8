"""What a closed loop refuses when it is made."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fracctl import ClosedLoop
from fracctl.controllers import DelayedFeedback, PDAlpha
from fracctl.errors import ArgumentError
from fracctl.plants import HCWOutOfPlane, Libration

GAIN = [[0.0, 0.3]]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: ClosedLoop(HCWOutOfPlane(), PDAlpha),
            r"`controller` must be an object, but is the class PDAlpha; make one of it, PDAlpha\(…\)",
        ),
        (lambda: ClosedLoop(HCWOutOfPlane), r"`plant` must be an object, but is the class HCWOutOfPlane; make one"),
        (
            lambda: ClosedLoop(Libration(), DelayedFeedback(GAIN, 1.0, history=[1.0, 2.0, 3.0])),
            "`history` must have one number or the 2 states of the plant, but is of 3",
        ),
        (
            lambda: ClosedLoop(
                Libration(), DelayedFeedback(GAIN, [1.0, 2.0], history=lambda t: np.zeros((*t.shape, 4)))
            ),
            "`history` must have one number or the 2 states of the plant, but is of 4",
        ),
    ],
)
def test_refusals(make: Callable[[], object], sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make()


def test_a_history_is_asked_between_the_delay_and_time_0() -> None:
    asked: list[np.ndarray] = []

    def past(times: np.ndarray) -> np.ndarray:
        asked.append(times)
        return np.stack([times, times], axis=-1)

    ClosedLoop(Libration(), DelayedFeedback(GAIN, [1.0, 2.0], history=past))
    assert asked[0].shape == (2, 1)
    assert ((asked[0] > -1.0) & (asked[0] < 0.0)).all()
    assert ClosedLoop(Libration(), DelayedFeedback(GAIN, 1.0, history=0.0)).batch is None
