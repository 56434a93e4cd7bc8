"""Navigation: what a controller is told of positions and velocities."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fracctl.arrays import Floats, finite
from fracctl.errors import ArgumentError

_BLOCK = 256
"""Samples whose noise is drawn at a time."""


@dataclass(frozen=True)
class Navigation:
    """Measured positions and velocities: white Gaussian noise, bias, and a rate of its own.

        y = [ξ + β_p + σ_p ε, ξ' + β_v + σ_v ε]

    Each member draws from a generator of its own, seeded by the run's seed and the member's number, so a member is the
    same in every batch.

    Args:
        position_noise: σ_p, (), (m,) or (b, m), over the plant's length.
        velocity_noise: σ_v, (), (m,) or (b, m), over the plant's speed.
        position_bias: β_p, (), (m,) or (b, m).
        velocity_bias: β_v, (), (m,) or (b, m).
        every: measurements come every so many periods of the controller and are held in between; at least 1.

    Raises:
        ArgumentError: noise is negative, or measurements come more often than the controller works.
    """

    position_noise: ArrayLike = 0.0
    velocity_noise: ArrayLike = 0.0
    position_bias: ArrayLike = 0.0
    velocity_bias: ArrayLike = 0.0
    every: int = 1

    def __post_init__(self) -> None:
        for name in ("position_noise", "velocity_noise", "position_bias", "velocity_bias"):
            value = finite(name, getattr(self, name))
            if name.endswith("noise") and (value < 0.0).any():
                raise ArgumentError(name, float(value.min()), "must not be negative")
            object.__setattr__(self, name, value)
        if self.every < 1:
            raise ArgumentError("every", self.every, "must be at least 1")

    def errors(self, seed: int, numbers: Sequence[int], n_controls: int, samples: int) -> Iterator[Floats]:
        """Yield the errors (b, 2m) of one measurement after the other, for `samples` of them.

        Args:
            seed: of the run.
            numbers: of the members, (b,).
            n_controls: m.
            samples: how many measurements.
        """
        shape = (len(numbers), n_controls)
        noises = (self.position_noise, self.velocity_noise)
        scale = np.concatenate([np.broadcast_to(noise, shape) for noise in noises], axis=1)
        bias = np.concatenate([np.broadcast_to(b, shape) for b in (self.position_bias, self.velocity_bias)], axis=1)
        if not scale.any():
            yield from (bias for _ in range(samples))
            return
        generators = [np.random.default_rng([seed, number]) for number in numbers]
        for first in range(0, samples, _BLOCK):
            count = min(_BLOCK, samples - first)
            drawn = np.stack([g.standard_normal((count, 2 * n_controls)) for g in generators], axis=1)
            yield from bias + scale * drawn
