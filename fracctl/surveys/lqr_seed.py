"""Gains of the linear-quadratic regulator as the place where a survey starts, or as the whole survey."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from fracctl.arrays import Floats
from fracctl.design.lqr import gains_by_name, lqr
from fracctl.errors import ArgumentError, ConfigurationError
from fracctl.evaluation import Evaluation
from fracctl.surveys.single import Single


@dataclass(frozen=True)
class LQRWeights:
    """What the linear-quadratic regulator minimises, as `fracctl.design.lqr` takes it."""

    q: ArrayLike = 1.0
    """Q; a number, its diagonal, or a matrix."""
    r: ArrayLike = 1.0
    """R; a number, its diagonal, or a matrix."""
    round_to: float | None = None
    """Gains become multiples of this; None leaves them."""


class LQRSeed(Single):
    """The controller with the gains of the linear-quadratic regulator.

    Args:
        evaluation: its law has gains k_p and k_d.
        seed: not used.
        lqr: weights.

    Raises:
        ArgumentError: a weight is wrong.
        ConfigurationError: the law has no such gains.
    """

    def __init__(self, evaluation: Evaluation, seed: int, lqr: LQRWeights) -> None:  # noqa: ARG002 - as every survey
        super().__init__(starting_point(evaluation, lqr))


def starting_point(evaluation: Evaluation, weights: LQRWeights | None) -> dict[str, float]:
    """Return the controller's value of every design variable; the gains are LQR's where weights are given.

    Raises:
        ArgumentError: a weight is wrong.
        ConfigurationError: the law has no such gains.
    """
    names, components = evaluation.design_variables, evaluation.plant.components
    point = {p.name: p.default for p in evaluation.law.parameters(components)} | dict(evaluation.parameters)
    if weights is not None:
        gains = gains_by_name(components, _gains(evaluation, weights))
        if missing := [name for name in gains if name not in names]:
            raise ConfigurationError(
                f"LQR gives the gains {', '.join(gains)}, but the controller has no {missing[0]}; choose another one"
            )
        point |= {name: float(value) for name, value in gains.items()}
    return {name: float(point[name]) for name in names}


def _gains(evaluation: Evaluation, weights: LQRWeights) -> Floats:
    try:
        return lqr(evaluation.plant, weights.q, weights.r, weights.round_to)
    except ArgumentError as error:
        raise ArgumentError(f"lqr.{error.name}", error.value, error.allowed, error.instead) from error
