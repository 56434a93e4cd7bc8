"""What a law flies in, stage by stage: each adds to the one before what the next flight test would."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from fracctl.arrays import Floats
from fracctl.dispersions import Distribution, check_names, draws
from fracctl.errors import ArgumentError
from fracctl.flight import uncertain
from fracctl.flight.stage_names import CERTAIN, Stage
from fracctl.loop import ClosedLoop
from fracctl.plants.capabilities import names_dispersed
from fracctl.plants.linear import LinearPlant
from fracctl.plants.state import StatePlant
from fracctl.sampled import Actuator, Memory, Navigation, SampledLaw, Window, dimensionless_time, memory_for
from fracctl.sampled.simulation import AntiWindup
from fracctl.sampled.tolerance import Kind
from fracctl.sampled.window import MOST_SAMPLES
from fracctl.units import Spacecraft


@dataclass(frozen=True)
class Sampling:
    """How laws run on board.

    Raises:
        ArgumentError: an argument lies outside its range.
    """

    period_s: float = 10.0
    """T_s, from one measurement to the next."""
    delay: float = 0.0
    """From a measurement to the control that answers it, in periods."""
    feed: Literal["position", "velocity"] = "velocity"
    """What derivatives are taken of."""
    memory: Kind = "exponentials"
    """What orders that are not whole are kept by."""
    memory_tolerance: float = 0.01
    """Of its frequency response, a decade to both sides of the loop's crossover; a window may have `samples`."""
    memory_samples: int | None = None
    """Length of a window, in its place."""
    anti_windup: AntiWindup = "none"
    """What a limit does to the memory."""
    history_orbits: float = 0.0
    """Of free drift before switch-on, whose measurements the memory knows; it begins at switch-on with 0."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.period_s) and self.period_s > 0.0):
            raise ArgumentError("period_s", self.period_s, "must be positive")
        if self.memory_samples is not None and self.memory != "window":
            allowed = f"goes with memory = window, but memory = {self.memory}"
            raise ArgumentError("memory_samples", self.memory_samples, allowed)
        if self.memory_samples is not None and self.memory_samples > MOST_SAMPLES:
            raise ArgumentError("memory_samples", self.memory_samples, f"must be at most {MOST_SAMPLES}")

    def law(self, loop: ClosedLoop) -> SampledLaw:
        """Return the law of a loop as it runs on board.

        Raises:
            UnsupportedError: the loop is not stable, so that no memory can be chosen for it, or the plant has no units.
        """
        plant: Any = loop.plant
        period = dimensionless_time(plant, self.period_s)
        law: Any = loop.controller
        if hasattr(law, "for_plant"):
            law = law.for_plant(plant)
        return SampledLaw(law, self._memory(loop, period), period, self.delay, self.feed)

    def _memory(self, loop: ClosedLoop, period: float) -> Memory:
        if self.memory_samples is not None:
            return Window(self.memory_samples)
        try:
            return memory_for(loop, self.memory, period, self.memory_tolerance, self.feed)
        except ArgumentError as error:
            if error.name != "tolerance":
                raise
            raise ArgumentError("memory_tolerance", error.value, error.allowed, error.instead) from error


@dataclass(frozen=True)
class Surroundings:
    """What flights meet beyond the design: thrusters, navigation, true motion, and what is uncertain of all this.

    Raises:
        ArgumentError: a dispersion has an unknown name, draws what cannot be, or is of a mass that is not given; the
            true plant is another kind of motion than that of the design.
    """

    plant: LinearPlant
    """Of the design, with scales."""
    truth: StatePlant | None = None
    """The motion from the stage ``nonlinear`` on; None for that of the design."""
    actuator: Actuator = field(default_factory=Actuator)
    navigation: Navigation = field(default_factory=Navigation)
    spacecraft: Spacecraft = field(default_factory=Spacecraft)
    dispersions: Mapping[str, Distribution] = field(default_factory=dict)
    """By the names of `known`."""
    seed: int = 0

    def __post_init__(self) -> None:
        if self.truth is not None and self.truth.n_states != self.plant.n_states:
            allowed = f"must have {self.plant.n_states} states as the plant of the design, but has"
            raise ArgumentError("truth", self.truth, f"{allowed} {self.truth.n_states}; take plant=hcw")
        check_names(self.dispersions, self.known)
        for name, distribution in self.dispersions.items():
            self._check_ends(name, distribution)
        if uncertain.MASS in self.dispersions and self.spacecraft.mass_kg is None:
            raise ArgumentError("dispersions", uncertain.MASS, "needs spacecraft.mass_kg, which the law is made for")

    def _check_ends(self, name: str, distribution: Distribution) -> None:
        """One impossible number would end a run of hundreds of flights."""
        try:
            if name in self._of_truth:
                truth: Any = self.truth
                truth.dispersed_by(**{name: np.array(distribution.ends)})
            else:
                uncertain.check(name, distribution.ends[0])
        except ArgumentError as error:
            allowed, cure = f"draws {error.value}, but {name} {error.allowed}", None
            if distribution.kind == "normal":
                mean, deviation = distribution.numbers[:2]
                cure = f"bound it: [normal, {mean:g}, {deviation:g}, lowest, highest]"
            raise ArgumentError(f"dispersions.{name}", str(distribution), allowed, cure) from error

    @property
    def known(self) -> list[str]:
        """Names of what may be uncertain."""
        own = [uncertain.MASS, uncertain.THRUST, *uncertain.NOISES, *uncertain.bias_names(self.plant)]
        return [*uncertain.offset_names(self.plant), *own, *self._of_truth]

    @property
    def _of_truth(self) -> tuple[str, ...]:
        return names_dispersed(self.truth)

    def drawn(self, samples: Floats) -> dict[str, Floats]:
        """Return the uncertain numbers of samples (b,), (b,) each."""
        return draws(self.dispersions, self.known, self.seed, [int(sample) for sample in samples])

    def of(
        self,
        stage: Stage,
        nominal: Floats,
        drawn: Mapping[str, Floats],
        count: int,
        size: uncertain.Size | None = None,
    ) -> Flown:
        """Return what `count` flights of a stage from a nominal state (n,) meet; only the last stage is uncertain.

        Args:
            stage: which.
            nominal: x(0), dimensionless.
            drawn: what is uncertain, (b,) each.
            count: b.
            size: what per cents of offsets are of, as `fracctl.flight.uncertain.starts` takes it.
        """
        states = np.repeat(nominal[None], count, axis=0)
        if stage in CERTAIN:
            return Flown(self.plant, states)
        truth = self.plant if stage == "noisy" or self.truth is None else self.truth
        met = Flown(truth, states, self.actuator, self.navigation)
        if stage != "dispersed" or not drawn:
            return met
        return self._dispersed(met, uncertain.starts(self.plant, nominal, drawn, size), drawn)

    def _dispersed(self, met: Flown, states: Floats, drawn: Mapping[str, Floats]) -> Flown:
        plant: Any = met.plant
        own = {name: values for name, values in drawn.items() if name in self._of_truth}
        factor = uncertain.efficiency(self.spacecraft.mass_kg, drawn)
        return Flown(
            plant.dispersed_by(**own) if own else plant,
            states,
            replace(self.actuator, efficiency=factor),
            self._navigation(drawn),
            drawn.get(uncertain.MASS),
        )

    def _navigation(self, drawn: Mapping[str, Floats]) -> Navigation:
        scales = self.plant.scales
        assert scales is not None
        position, velocity = uncertain.biases(self.plant, drawn)
        changed: dict[str, Any] = {
            "position_bias": position + np.asarray(self.navigation.position_bias),
            "velocity_bias": velocity + np.asarray(self.navigation.velocity_bias),
        }
        for name, unit in zip(uncertain.NOISES, (scales.length_m, scales.speed_m_s), strict=True):
            if name in drawn:
                changed[name.rsplit("_m", 1)[0]] = drawn[name][:, None] / unit
        return replace(self.navigation, **changed)


@dataclass(frozen=True)
class Flown:
    """What a batch of flights meets."""

    plant: StatePlant
    states: Floats
    """At time 0, (b, n)."""
    actuator: Actuator | None = None
    navigation: Navigation | None = None
    mass_kg: Floats | None = None
    """Of every flight, (b,); None for that of the spacecraft."""
