"""One law of a comparison: what is varied, and how its points become rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from fracctl.arrays import Array, Floats
from fracctl.controllers.linear import ModelBasedLaw
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pd import PD
from fracctl.design.lqr import gains_by_name
from fracctl.evaluation import Evaluation, ParametrisedLaw
from fracctl.measures import SettlingTime
from fracctl.trajectory import Trajectory

LARGEST_GAIN = "largest_gain"
"""Column of the largest magnitude of a law's gains."""
LOGARITHMIC = ("time", "weight")
"""Kinds of parameters that are searched over on a logarithmic scale."""


class TimesWithin:
    """Settling times to several bands, one column each; see `fracctl.measures.SettlingTime`.

    Args:
        thresholds: δ > 0, dimensionless, by column.
    """

    name = "settling_times"

    def __init__(self, thresholds: Mapping[str, float]) -> None:
        self.columns = tuple(thresholds)
        self._measures = {column: SettlingTime(threshold) for column, threshold in thresholds.items()}

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the columns, (b,) each."""
        return {column: measure(trajectory)[measure.name] for column, measure in self._measures.items()}


@dataclass(frozen=True)
class LawEvaluation(Evaluation):
    """An evaluation whose design may be weights, from which the gains follow, or logarithms.

    Its rows hold the parameters of the law and, where they follow from weights, these before them; and `largest_gain`.
    """

    weighed_by: type[ParametrisedLaw] | None = None
    """The law whose parameters are weights, where there is one: its gains are those of `law`, PD."""
    in_logarithms: frozenset[str] = frozenset()
    """Parameters that a design gives as their logarithms to base 10."""

    @property
    def designed(self) -> type[ParametrisedLaw]:
        """The law whose parameters a design holds."""
        return self.weighed_by or self.law

    @cached_property
    def design_variables(self) -> tuple[str, ...]:
        """Parameters that a design holds, in the order of the columns."""
        return tuple(parameter.name for parameter in self.designed.parameters(self.plant.components))

    @cached_property
    def row_columns(self) -> tuple[str, ...]:
        """Columns of the rows, in order."""
        weights = self.design_variables if self.weighed_by else ()
        condition, *others = self.plain.row_columns
        return (condition, *weights, *others, LARGEST_GAIN)

    @cached_property
    def plain(self) -> Evaluation:
        """The evaluation of the gains."""
        names = [field.name for field in fields(Evaluation)]
        held = {} if self.weighed_by else self.parameters
        return Evaluation(**{name: getattr(self, name) for name in names} | {"parameters": held})

    def __call__(self, design: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the rows of b design points, as `fracctl.evaluation.Evaluation` does."""
        given = self.natural(design)
        gains = self.gains(given) if self.weighed_by else given
        rows = self.plain(gains)
        names = [p.name for p in self.law.parameters(self.plant.components) if p.kind == "gain"]
        rows[LARGEST_GAIN] = np.abs([rows[name] for name in names]).max(axis=0)
        if self.weighed_by:
            copies = len(self.initial_conditions)
            rows |= {name: np.tile(given[name], copies) for name in self.design_variables}
        return {name: rows[name] for name in self.row_columns}

    def natural(self, design: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return a design with all its parameters, none of them as a logarithm, (b,) each."""
        size = max((len(values) for values in design.values()), default=1)
        values = {**self.parameters, **design}
        natural = {name: np.broadcast_to(np.asarray(values[name], float), (size,)) for name in self.design_variables}
        return {name: 10.0**v if name in self.in_logarithms and name in design else v for name, v in natural.items()}

    def gains(self, weights: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return the gains that follow from weights, (b,) each."""
        law = self.designed.from_parameters(self.plant.components, dict(weights))
        assert isinstance(law, ModelBasedLaw)
        found = law.for_plant(self.plant)
        assert isinstance(found, PD)
        size = len(next(iter(weights.values())))
        m = self.plant.n_controls
        blocks = [np.broadcast_to(k.reshape(-1, m, m), (size, m, m)) for k in (found.k_p, found.k_d)]
        return gains_by_name(self.plant.components, np.concatenate(blocks, axis=-1))


@dataclass(frozen=True)
class Law:
    """A law that takes part."""

    name: str
    evaluation: LawEvaluation
    """With all settling bands."""
    varied: tuple[Parameter, ...]
    """What is searched over, in the order of the columns."""

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Parameters of the gains, not of what they follow from, by name."""
        components = self.evaluation.plant.components
        return {parameter.name: parameter for parameter in self.evaluation.law.parameters(components)}

    @property
    def searched(self) -> LawEvaluation:
        """The evaluation in the coordinates of searches."""
        names = frozenset(p.name for p in self.varied if p.kind in LOGARITHMIC)
        return replace(self.evaluation, in_logarithms=names)

    @property
    def by_gains(self) -> LawEvaluation:
        """The evaluation of the gains themselves."""
        if self.evaluation.weighed_by is None:
            return self.evaluation
        return replace(self.evaluation, weighed_by=None, parameters={})

    def coordinates(self, rows: Mapping[str, Array]) -> Floats:
        """Return rows of the table in the coordinates of searches, (b, n)."""
        columns = [np.log10(rows[p.name]) if p.kind in LOGARITHMIC else rows[p.name] for p in self.varied]
        return np.stack([np.asarray(column, dtype=np.float64) for column in columns], axis=1)

    def point_of(self, other: Law, row: Mapping[str, float], lag: float) -> dict[str, float]:
        """Return the parameters of this law at a row of another one: where that has none, orders are 1, gains 0."""
        neutral = {"order": 1.0, "gain": 0.0, "time": lag}
        simple = {name: neutral[parameter.kind] for name, parameter in self.parameters.items()}
        return simple | {name: float(row[name]) for name in other.by_gains.design_variables if name in simple}

    def design(self, points: Floats) -> dict[str, Floats]:
        """Return points (b, n) in the coordinates of searches as a design of `searched`."""
        return {p.name: np.ascontiguousarray(points[:, i]) for i, p in enumerate(self.varied)}


def extends(outer: Law, inner: Law) -> bool:
    """Return whether a law comes down to another one where further orders are 1, and further gains and lags 0."""
    own, other = outer.evaluation.design_variables, inner.by_gains.design_variables
    if outer.evaluation.weighed_by is not None or outer.name == inner.name or not set(other) <= set(own):
        return False
    return len(other) < len(own) or inner.evaluation.weighed_by is not None


def varied_of(parameters: Sequence[Parameter], names: Sequence[str] | None) -> tuple[Parameter, ...]:
    """Return the parameters of these names or, for None, all."""
    return tuple(p for p in parameters if names is None or p.name in names)
