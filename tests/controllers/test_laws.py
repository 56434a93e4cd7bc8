"""Laws with lags, integrals and several derivatives: names and ranges of parameters, refusals, and their terms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fracctl.controllers import PD, PID, PDAlpha, PDDAlpha, PDLag, PILambdaDMu
from fracctl.errors import ArgumentError
from fracctl.evaluation import ParametrisedLaw
from fracctl.loop import ClosedLoop
from fracctl.plants import HCWInPlane, HCWOutOfPlane

ENTRIES = ("u", "uv", "vu", "v")
LAWS: dict[type[Any], list[str]] = {
    PDLag: ["time_constant", "k_p", "k_d"],
    PID: ["time_constant", "k_p", "k_i", "k_d"],
    PDDAlpha: ["alpha", "k_p", "k_d", "k_d_alpha"],
    PILambdaDMu: ["lambda", "mu", "k_p", "k_i", "k_d"],
}
"""Prefixes of the parameters in the order of the columns."""


@pytest.mark.parametrize(("law", "prefixes"), LAWS.items())
def test_parameter_names_in_table_order(law: ParametrisedLaw, prefixes: list[str]) -> None:
    gains = [p for p in prefixes if p.startswith("k_")]
    others = [p for p in prefixes if p not in gains]
    assert [p.name for p in law.parameters(("w",))] == [f"{prefix}_w" for prefix in prefixes]
    planar = [f"{p}_{c}" for p in others for c in ("u", "v")] + [f"{p}_{entry}" for p in gains for entry in ENTRIES]
    assert [p.name for p in law.parameters(("u", "v"))] == planar


@pytest.mark.parametrize("law", LAWS)
def test_parameters_know_what_they_are(law: ParametrisedLaw) -> None:
    for parameter in law.parameters(("u", "v")):
        if parameter.name.startswith("k_"):
            assert (parameter.kind, parameter.default) == ("gain", 0.0)
            assert parameter.contains(-1e9)
        elif parameter.name.startswith("time_constant_"):
            assert (parameter.kind, parameter.allowed) == ("time", "must lie in (0, inf)")
        else:
            assert (parameter.kind, parameter.default, parameter.allowed) == ("order", 1.0, "must lie in (0, 1]")


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("plant", "m"), [(HCWOutOfPlane(), 1), (HCWInPlane(), 2)])
def test_parameters_are_single_laws_or_batches(law: ParametrisedLaw, plant: Any, m: int) -> None:
    names = [p.name for p in law.parameters(plant.components)]
    assert ClosedLoop(plant, law.from_parameters(plant.components, {})).batch is None
    for count in (1, 3):
        values = {names[0]: np.linspace(0.2, 0.9, count), names[-1]: np.arange(count)}
        assert ClosedLoop(plant, law.from_parameters(plant.components, values)).batch == count
    with pytest.raises(ArgumentError, match=f"`{names[0]}` must hold finite numbers"):
        law.from_parameters(plant.components, {names[0]: np.nan})


@pytest.mark.parametrize("law", LAWS)
def test_parameters_land_where_their_names_say(law: ParametrisedLaw) -> None:
    """Each value occurs in the law's matrices or orders exactly where its name says, and nowhere else."""
    names = [p.name for p in law.parameters(("u", "v"))]
    values = dict(zip(names, np.linspace(0.11, 0.97, len(names)), strict=True))
    built = law.from_parameters(("u", "v"), values)
    for prefix in LAWS[law]:
        attribute = {"lambda": "integral_order", "mu": "derivative_order"}.get(prefix, prefix)
        if prefix.startswith("k_"):
            expected = np.reshape([values[f"{prefix}_{entry}"] for entry in ENTRIES], (2, 2))
        else:
            expected = np.array([values[f"{prefix}_u"], values[f"{prefix}_v"]])
        np.testing.assert_array_equal(getattr(built, attribute), expected)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: PDLag(1.0, 1.0, 0.0), r"`time_constant` must be positive, but is 0"),
        (lambda: PID(1.0, 0.0, 1.0, [0.1, -0.2]), r"`time_constant` must be positive, but is -0.2"),
        (lambda: PID(1.0, np.inf, 1.0, 0.1), r"`k_i` must hold finite numbers only"),
        (lambda: PDDAlpha(1.0, 1.0, 1.0, 1.2), r"`alpha` must lie in \(0, 1\], but is 1.2"),
        (lambda: PILambdaDMu(1.0, 1.0, 1.0, 0.0), r"`integral_order` must lie in \(0, 1\], but is 0"),
        (lambda: PILambdaDMu(1.0, 1.0, 1.0, 1.0, 1.5), r"`derivative_order` must lie in \(0, 1\], but is 1.5"),
        (lambda: PDDAlpha(1.0, 1.0, np.nan, 0.9), r"`k_d_alpha` must hold finite numbers only"),
    ],
)
def test_what_no_law_can_take_is_refused(make: Any, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        make()


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        (PDLag(np.eye(2), np.eye(2), [0.1, 0.1, 0.1]), r"`time_constant` must have shape \(\), \(2,\) or \(b, 2\)"),
        (PID(np.eye(2), 0.0, np.eye(2), 0.1), r"`k_i` must have shape \(2, 2\) or \(b, 2, 2\)"),
        (PDDAlpha(np.eye(2), np.eye(2), 1.0, 0.9), r"`k_d_alpha` must have shape \(2, 2\) or \(b, 2, 2\)"),
        (PILambdaDMu(*3 * [np.eye(2)], [0.5, 0.5, 0.5]), r"`integral_order` must have shape \(\), \(2,\) or"),
    ],
)
def test_wrong_shapes_get_the_allowed_ones(law: Any, sentence: str) -> None:
    with pytest.raises(ArgumentError, match=sentence):
        ClosedLoop(HCWInPlane(), law)


def test_batches_of_different_sizes_are_refused() -> None:
    with pytest.raises(ArgumentError, match="must have the same batch size as"):
        ClosedLoop(HCWOutOfPlane(), PDLag([1.0, 2.0], 1.0, [0.1, 0.2, 0.3]))


def test_laws_meet_in_their_limits() -> None:
    """PDD^α without K_D is PD^α; PI^λD^μ without K_I is PD^μ, with K_I and orders of 1 it is PID; PID holds PDLag."""
    gains = np.array([[4.0, -0.95], [3.0, 0.3]]), np.array([[2.4, 0.65], [0.65, 1.95]])
    no = np.zeros((2, 2))
    pairs = [
        (PDDAlpha(gains[0], no, gains[1], [0.9, 0.7]), PDAlpha(*gains, [0.9, 0.7])),
        (PDDAlpha(*gains, no, [0.9, 0.7]), PD(*gains)),
        (PILambdaDMu(gains[0], no, gains[1], 0.5, [0.9, 0.7]), PDAlpha(*gains, [0.9, 0.7])),
        (PID(gains[0], no, gains[1], [0.1, 0.2]), PDLag(*gains, [0.1, 0.2])),
    ]
    sigma = np.array([0.3 + 0.8j, -1.2 + 0.1j])
    for first, second in pairs:
        determinants = [determinant(ClosedLoop(HCWInPlane(), law), sigma) for law in (first, second)]
        np.testing.assert_allclose(*determinants, rtol=1e-13)


def determinant(loop: ClosedLoop, sigma: np.ndarray) -> np.ndarray:
    """Return det Σ A_j diag(σ^β_j)."""
    terms = loop.system.dynamics
    return np.array([np.linalg.det(sum(term.matrix * s**term.orders for term in terms)) for s in sigma])
