"""Design for starts that are not known exactly: a point counts by a quantile over dispersed starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.dispersions import Distribution, check_names, draws
from fracctl.errors import ArgumentError
from fracctl.evaluation import BEYOND_LIMITS, COUNTERS, Evaluation, geometric_mean
from fracctl.flight import uncertain
from fracctl.measures.limits import excess

_BAD = ("failed", "unstable", "diverged", "unsettled")
"""Words of rows that are not ok, the most telling first."""


@dataclass(frozen=True)
class RobustEvaluation(Evaluation):
    """Design points judged over dispersed starts, one row for all starts about each initial condition.

    A measure of a row is the least value that a share `quantile` of the starts does not exceed, objectives are formed
    of these, and a row is ``ok`` if as many starts are. Other samples of the same dispersions test the design:
    `fracctl.flight.FlightEvaluation` with another `first_sample`.

    Raises:
        ArgumentError: a dispersion is not of a start, there are none, the plant has no units; or as `Evaluation`.
    """

    dispersions: Mapping[str, Distribution] = field(default_factory=dict, kw_only=True)
    """Of starts, by the names of `fracctl.flight.uncertain.offset_names`."""
    sizes: Mapping[str, uncertain.Size] = field(default_factory=dict, kw_only=True)
    """What per cents are of, by initial condition; those of the states where none are given."""
    samples: int = field(default=50, kw_only=True)
    first_sample: int = field(default=0, kw_only=True)
    """Number of the first."""
    quantile: float = field(default=0.95, kw_only=True)
    seed: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.plant.scales is None:
            raise ArgumentError("plant", self.plant, "must have units for dispersed starts; set plant.scales")
        if not self.dispersions:
            raise ArgumentError("dispersions", {}, "must hold at least one")
        check_names(self.dispersions, self._known)

    @property
    def _known(self) -> list[str]:
        return uncertain.offset_names(self.plant)

    @cached_property
    def _each(self) -> Evaluation:
        """The evaluation of every start for itself."""
        numbers = range(self.first_sample, self.first_sample + self.samples)
        drawn = draws(self.dispersions, self._known, self.seed, numbers)
        states = {
            f"{name} {number}": state
            for name, nominal in self.initial_conditions.items()
            for number, state in enumerate(uncertain.starts(self.plant, nominal, drawn, self.sizes.get(name)))
        }
        return Evaluation(
            self.plant,
            self.law,
            self.parameters,
            states,
            self.solver,
            self.measures,
            self.objectives,
            self.objective,
            self.horizon,
            saturation=self.saturation,
            loop_measures=self.loop_measures,
        )

    def __call__(self, design: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the rows of b design points: all points of the first initial condition, then of the next."""
        names = list(self.initial_conditions)
        by_start = {n: v.reshape(len(names), self.samples, -1) for n, v in self._each(design).items()}
        rows = {name: by_start[name][:, 0] for name in (*self.design_variables, "stable")}
        rows |= {name: self._quantile(by_start[name]) for name in self.measured_columns}
        means = {name: geometric_mean([rows[c] for c in columns]) for name, columns in self.objectives.items()}
        rows |= {"objective": means[self.objective]} | {f"objective_{name}": mean for name, mean in means.items()}
        rows["status"] = self._status(by_start["status"])
        rows["error_estimate"] = by_start["error_estimate"].max(axis=1)
        rows |= {name: by_start[name].max(axis=1) for name in COUNTERS}
        flat = {name: values.ravel() for name, values in rows.items()}
        flat["initial_condition"] = np.repeat(np.array(names, dtype=object), rows["status"].shape[1])
        broken = (flat["status"] == "ok") & (excess(flat, self.constraints) > 0.0)
        flat["status"][broken] = BEYOND_LIMITS
        return {name: flat[name] for name in self.row_columns}

    @property
    def _needed(self) -> int:
        """How many starts must be no worse."""
        return max(1, int(np.ceil(self.quantile * self.samples - 1e-9)))

    def _quantile(self, values: Floats) -> Floats:
        ranked: Floats = np.sort(values, axis=1)[:, self._needed - 1]
        return ranked

    def _status(self, words: Array) -> Array:
        status = np.full(words[:, 0].shape, "ok", dtype=object)
        enough = (words == "ok").sum(axis=1) >= self._needed
        for word in reversed(_BAD):
            status[~enough & (words == word).any(axis=1)] = word
        return status
