"""What all parts of a comparison share: laws, problems, and the columns of their rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NoReturn

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.comparison.laws import LARGEST_GAIN, LOGARITHMIC, Law, LawEvaluation, TimesWithin, varied_of
from fracctl.comparison.problems import GAIN, KEYS, LAW, LIMIT, PEAK, Problem, objective_within, settling_time_within
from fracctl.controllers.linear import ModelBasedLaw
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pd import PD
from fracctl.errors import ArgumentError, suggestion
from fracctl.evaluation import COUNTERS, Evaluation, ParametrisedLaw
from fracctl.measures import ControlEffort, PeakAcceleration
from fracctl.measures.base import Measure
from fracctl.surveys.search import KINDS
from fracctl.surveys.search_run import Variable

_SETTLING_TIME = "settling_time"
_MM = 1e-3
_ROUNDING = 1e-12


@dataclass(frozen=True)
class ComparedLaw:
    """A law as the configuration gives it."""

    law: type[ParametrisedLaw]
    vary: tuple[str, ...] | None = None
    """What is searched over; None for all parameters."""
    values: Mapping[str, float] = field(default_factory=dict)
    """Values of the others; their defaults where none are given."""


@dataclass(frozen=True)
class ComparedLaws(Evaluation):
    """Several laws on the same problems, the primary objective with each settling band under each limit.

    `objective` is the one of the row's own
    problem; the columns ``objective_within_…_m`` hold those of all bands, whatever the row was searched for.

    Raises:
        ArgumentError: a name is unknown, a number is not positive, bounds are missing or wrong, or the plant has no
            scales.
    """

    factors: tuple[str, ...] = (_SETTLING_TIME,)
    """Columns of measures whose geometric mean is minimised."""
    laws: Mapping[str, ComparedLaw] = field(default_factory=dict)
    reference: str = "pd"
    """The law that others are compared with."""
    thresholds_m: tuple[float, ...] = ()
    """Settling bands δ in metres."""
    gain_limits: tuple[float, ...] = ()
    """Largest gains."""
    peak_limits_mm_per_s2: tuple[float, ...] = ()
    """Peak accelerations, with gains up to `widest_gain`."""
    widest_gain: float = 16.0
    negative_gains: bool = False
    """Whether gains may be negative."""
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """[lower, upper] of all varied ``orders``, ``times`` and ``weights``."""
    report_periods: tuple[float, ...] = (2.0, 6.0)
    """Horizons, in periods, at which the objective of every best point is given."""

    def __post_init__(self) -> None:
        if self.plant.scales is None:
            instead = "set plant.scales, or take plant=hcw"
            raise ArgumentError("plant", type(self.plant).__name__, "must have units, for limits are in SI", instead)
        if self.reference not in self.laws:
            allowed = f"must be one of the laws ({', '.join(self.laws)}){suggestion(self.reference, self.laws)}"
            raise ArgumentError("reference", self.reference, allowed)
        lists = ("thresholds_m", "gain_limits", "peak_limits_mm_per_s2", "report_periods")
        for name in lists:
            values = getattr(self, name)
            if any(not (np.isfinite(value) and value > 0.0) for value in values) or len(set(values)) < len(values):
                raise ArgumentError(name, list(values), "must hold different positive numbers")
        if not self.thresholds_m or not self.limits:
            raise ArgumentError("thresholds_m", list(self.thresholds_m), "must hold a band, with a limit beside it")
        if self.widest_gain < max(self.gain_limits, default=0.0):
            raise ArgumentError("widest_gain", self.widest_gain, "must be no less than the largest of `gain_limits`")
        for kind, ends in self.bounds.items():
            check_kind("bounds", kind, list(ends), [kind for kind in KINDS if kind != "gains"])
        for name in self.laws:
            self._check_law(name)

    def _check_law(self, name: str) -> None:
        given = self.laws[name]
        parameters = {p.name: p for p in given.law.parameters(self.plant.components)}
        for argument, names in (("vary", given.vary or ()), ("values", given.values)):
            for wrong in set(names) - set(parameters):
                known = f"must name parameters of the law ({', '.join(parameters)})"
                raise ArgumentError(f"laws.{name}.{argument}", wrong, known + suggestion(wrong, parameters))
        for parameter in self.law_of(name).varied:
            if parameter.kind == "gain":
                continue
            kind = f"{parameter.kind}s"
            lower, upper = self.bounds.get(kind, (np.nan, np.nan))
            if not (parameter.contains(lower) and parameter.contains(upper) and lower < upper):
                self._refuse_bounds(kind, parameter)
            if parameter.kind in LOGARITHMIC and not lower > 0.0:
                raise ArgumentError(f"bounds.{kind}", [lower, upper], "must be positive, for they are searched in logs")

    def _refuse_bounds(self, kind: str, parameter: Parameter) -> NoReturn:
        given = self.bounds.get(kind)
        allowed = f"must be [lower, upper] for {parameter.name}; it {parameter.allowed}"
        raise ArgumentError(f"bounds.{kind}", None if given is None else list(given), allowed)

    @cached_property
    def limits(self) -> tuple[tuple[str, float], ...]:
        """Kind and value of every limit."""
        return (*((GAIN, v) for v in self.gain_limits), *((PEAK, v) for v in self.peak_limits_mm_per_s2))

    @cached_property
    def problems(self) -> tuple[Problem, ...]:
        """Every limit with every band; limits outermost."""
        return tuple(Problem(t, kind, value) for kind, value in self.limits for t in self.thresholds_m)  # type: ignore[arg-type]

    @cached_property
    def design_variables(self) -> tuple[str, ...]:
        """Parameters of all laws, of the reference first."""
        names = [self.reference, *(name for name in self.laws if name != self.reference)]
        return tuple(dict.fromkeys(column for name in names for column in self._parameter_columns(name)))

    def _parameter_columns(self, law: str) -> tuple[str, ...]:
        evaluation = self.law_of(law).evaluation
        gains = tuple(parameter.name for parameter in evaluation.law.parameters(self.plant.components))
        return evaluation.design_variables if evaluation.weighed_by is None else (*evaluation.design_variables, *gains)

    @cached_property
    def row_columns(self) -> tuple[str, ...]:
        """Columns of the rows, in order."""
        measured = tuple(column for measure in self._measures(self.thresholds_m) for column in measure.columns)
        objectives = ("objective", *(f"objective_{objective_within(t)}" for t in self.thresholds_m))
        tail = (LARGEST_GAIN, *objectives, "status", "stable", "error_estimate", *COUNTERS)
        return ("initial_condition", *KEYS, *self.design_variables, *measured, *tail)

    def law_of(self, name: str, thresholds_m: Sequence[float] | None = None) -> Law:
        """Return a law with its evaluation for some bands, or all."""
        given = self.laws[name]
        bands = self.thresholds_m if thresholds_m is None else thresholds_m
        parameters = given.law.parameters(self.plant.components)
        values = {p.name: given.values.get(p.name, p.default) for p in parameters}
        by_weights = isinstance(given.law.from_parameters(self.plant.components, values), ModelBasedLaw)
        evaluation = LawEvaluation(
            plant=self.plant,
            law=PD if by_weights else given.law,
            parameters=values,
            initial_conditions=self.initial_conditions,
            solver=self.solver,
            measures=self._measures(bands),
            objectives={objective_within(t): self._factors(t) for t in bands},
            objective=objective_within(bands[0]),
            horizon=self.horizon,
            weighed_by=given.law if by_weights else None,
        )
        return Law(name, evaluation, varied_of(parameters, given.vary))

    def _factors(self, threshold_m: float) -> tuple[str, ...]:
        within = settling_time_within(threshold_m)
        return tuple(within if column == _SETTLING_TIME else column for column in self.factors)

    def _measures(self, thresholds_m: Sequence[float]) -> tuple[Measure, ...]:
        assert self.plant.scales is not None
        bands = {settling_time_within(t): t / self.plant.scales.length_m for t in thresholds_m}
        others = [measure for measure in self.measures if measure.columns != (_SETTLING_TIME,)]
        names = [measure.name for measure in others]
        needed: tuple[Any, ...] = (ControlEffort(), PeakAcceleration())
        return (TimesWithin(bands), *others, *(measure for measure in needed if measure.name not in names))

    def peak(self, problem: Problem) -> float:
        """Return the dimensionless peak acceleration that a problem allows, infinite where it limits gains."""
        assert self.plant.scales is not None
        return _MM * problem.value / self.plant.scales.acceleration_m_s2 if problem.limit == PEAK else np.inf

    def largest_gain(self, problem: Problem) -> float:
        """Return the largest gain that a problem allows."""
        return problem.value if problem.limit == GAIN else self.widest_gain

    def box(self, law: Law, largest_gain: float) -> tuple[Variable, ...]:
        """Return the bounds of what is varied, in the coordinates of searches."""
        variables = []
        for parameter in law.varied:
            if parameter.kind == "gain":
                lower, upper = (-largest_gain if self.negative_gains else 0.0), largest_gain
            else:
                lower, upper = self.bounds[f"{parameter.kind}s"]
            if parameter.kind in LOGARITHMIC:
                lower, upper = float(np.log10(lower)), float(np.log10(upper))
            variables.append(Variable(parameter.name, lower, upper))
        return tuple(variables)

    def excess(self, rows: Mapping[str, Array], problem: Problem) -> Floats:
        """Return by how much rows of a law exceed the limits of a problem, relative to them, (n,)."""
        gains = np.asarray(rows[LARGEST_GAIN], dtype=np.float64) / self.largest_gain(problem)
        excess: Floats = np.maximum(gains - 1.0 - _ROUNDING, 0.0)
        if problem.limit == PEAK:
            peaks = np.asarray(rows[PeakAcceleration.name], dtype=np.float64) / self.peak(problem)
            excess = excess + np.maximum(peaks - 1.0, 0.0)
        return excess

    def admissible(self, rows: Mapping[str, Array], problem: Problem) -> Floats:
        """Return the objective of a problem in rows of a law, infinite where they break its limit, (n,)."""
        values: Floats = np.asarray(rows[f"objective_{problem.objective}"], dtype=np.float64)
        return np.where(sound(rows) & (self.excess(rows, problem) <= 0.0), values, np.inf)

    def table_rows(
        self, rows: Mapping[str, Array], law: str, problems: Sequence[Problem], **keys: Any
    ) -> dict[str, Array]:
        """Return rows of a law with the columns of the table.

        Args:
            rows: of the law's evaluation.
            law: its name.
            problems: of each row.
            keys: values of `KEYS` besides law and problem, numbers or (n,).
        """
        n = len(problems)
        table: dict[str, Array] = {name: np.full(n, np.nan) for name in self.row_columns}
        table |= {name: np.asarray(rows[name]) for name in self.row_columns if name in rows}
        names = [f"objective_{problem.objective}" for problem in problems]
        table["objective"] = np.array([rows[name][i] for i, name in enumerate(names)], dtype=np.float64)
        settled = np.isfinite(table["objective"]) & sound(rows)
        table["status"] = np.where(settled & (rows["status"] == "unsettled"), "ok", rows["status"]).astype(object)
        table |= {
            LAW: np.full(n, law, dtype=object),
            LIMIT: np.array([problem.limit for problem in problems], dtype=object),
            "limit_value": np.array([problem.value for problem in problems]),
            "threshold_m": np.array([problem.threshold_m for problem in problems]),
            "start": np.full(n, np.nan),
            "horizon_periods": np.full(n, self.horizon / (2.0 * np.pi)),
        }
        for name, value in keys.items():
            table[name] = np.full(n, value, dtype=object if isinstance(value, str) else np.float64)
        return table

    def by_law(self, rows: Mapping[str, Array]) -> Iterator[tuple[Evaluation, Array]]:
        """Yield each law's evaluation by its gains, with the places of its rows."""
        for name in self.laws:
            yield self.law_of(name).by_gains, np.flatnonzero(np.asarray(rows[LAW]) == name)

    def loop(self, design: Mapping[str, Floats | float]) -> Any:
        """Return the reference law's loop."""
        return self.law_of(self.reference).evaluation.loop(design)


def check_kind(argument: str, kind: str, value: object, known: Sequence[str]) -> None:
    """Raise ArgumentError unless a key names a kind of parameters."""
    if kind not in known:
        allowed = f"has no meaning, for kinds of parameters are {', '.join(known)}{suggestion(kind, known)}"
        raise ArgumentError(f"{argument}.{kind}", value, allowed)


def sound(rows: Mapping[str, Array]) -> Booleans:
    """Return which rows were solved and are certified to be stable, (n,)."""
    stable: Booleans = np.equal(np.asarray(rows["stable"], dtype=object), True)
    return stable & np.isin(rows["status"], ("ok", "unsettled"))
