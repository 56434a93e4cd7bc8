"""Which plant offers what, and that what asks for it says so where it is missing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fracctl import ClosedLoop, solve
from fracctl.controllers import AdaptiveSlidingMode
from fracctl.controllers.fractional_sliding_mode import FractionalSlidingMode
from fracctl.design import first_return, lqr, natural_period
from fracctl.errors import UnsupportedError
from fracctl.plants import (
    FunctionPlant,
    HCWInPlane,
    Libration,
    PerturbedRelativeMotion,
    RelativeMotion,
    Tether,
    TschaunerHempel,
)
from fracctl.plants import RotatingEllipsoid as Ellipsoid
from fracctl.plants import capabilities as known

OWN = FunctionPlant(lambda t, x, u: -x + u, 1, 1)
OFFERS = {
    known.PeriodicPlant: (
        *(HCWInPlane(), Libration(), RelativeMotion(), TschaunerHempel(), PerturbedRelativeMotion(), Tether()),
    ),
    known.LinearPeriodicPlant: (TschaunerHempel(),),
    known.SectionedPlant: (Ellipsoid(),),
    known.CompiledPlant: (Tether(),),
    known.LimitedPlant: (Tether(),),
    known.ConstrainedPlant: (Tether(),),
    known.TensionedPlant: (Tether(),),
    known.DispersedPlant: (RelativeMotion(), TschaunerHempel(), PerturbedRelativeMotion(), Tether()),
    known.OrbitalPlant: (HCWInPlane(), RelativeMotion(), TschaunerHempel(), PerturbedRelativeMotion()),
    known.ChiefPlant: (HCWInPlane(),),
    known.TurningPlant: (PerturbedRelativeMotion(),),
    known.BatchedPlant: (RelativeMotion(), TschaunerHempel(), PerturbedRelativeMotion(), Tether()),
}


@pytest.mark.parametrize("capability", list(OFFERS), ids=lambda kind: kind.__name__)
def test_plants_offer_what_they_say(capability: type) -> None:
    about_leaders = (RelativeMotion(), TschaunerHempel(), PerturbedRelativeMotion())
    plants = (OWN, HCWInPlane(), Libration(), Ellipsoid(), *about_leaders, Tether())
    having = {type(plant) for plant in OFFERS[capability]}
    offering = {type(plant) for plant in plants if isinstance(plant, capability)}
    if capability is known.PeriodicPlant:
        offering = {type(plant) for plant in plants if known.period_of(plant) is not None}
    assert offering == having


def test_dispersed_plants_take_every_name_that_they_offer() -> None:
    for plant in OFFERS[known.DispersedPlant]:
        for name in known.names_dispersed(plant):
            other = plant.dispersed_by(**{name: np.array([0.1, 0.2])})
            assert known.batch_of(other) == 2
            assert known.batch_of(plant) is None
    assert known.names_dispersed(OWN) == ()


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: natural_period(OWN), "FunctionPlant has no period of its own; use `first_return`, or give a delay"),
        (lambda: natural_period(Ellipsoid()), "RotatingEllipsoid has no period of its own"),
        (lambda: first_return(Libration(), [0.0, 1.0]), "Libration has no section of its own; give `section`"),
        (lambda: lqr(Libration(), 1.0, 1.0), "lqr takes linear plants, but Libration is none"),
        (lambda: FractionalSlidingMode().numbers(Libration(), 1), "is a law for a tether, not for Libration"),
        (
            lambda: solve(ClosedLoop(Libration(), AdaptiveSlidingMode()), [0.0, 1.0], 1.0, "implicit_memory"),
            "needs a plant with a compiled acceleration, as Tether has",
        ),
    ],
)
def test_what_is_missing_is_said(ask: Callable[[], object], sentence: str) -> None:
    with pytest.raises(UnsupportedError, match=sentence):
        ask()


def test_the_reconstruction_has_as_many_numbers_as_it_says() -> None:
    assert FractionalSlidingMode().numbers(Tether(), 3).shape == (3, 8)
