"""From laws to rows of flights: every law through the same stages, sample by sample."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.dispersions import SAMPLE
from fracctl.errors import ArgumentError, UnsupportedError, suggestion
from fracctl.evaluation import COUNTERS, LAW_NUMBER, Conclusion, Evaluation
from fracctl.flight import conclusion, history, single_flights, uncertain
from fracctl.flight import rows as rows_of
from fracctl.flight.implementations import IMPLEMENTATIONS, Implementations
from fracctl.flight.measured import names, takes
from fracctl.flight.stage_names import CERTAIN, STAGES, Stage
from fracctl.flight.stages import Flown, Sampling, Surroundings
from fracctl.loop import ClosedLoop
from fracctl.memory_evaluation import LAW, NamedLaw, check_laws
from fracctl.sampled import DiscreteController, SampledTrajectory, simulate
from fracctl.stability import assess

FLIGHT, STAGE = "flight", "stage"
_ABREAST = 256
"""Flights of a batch: their states are kept at all samples."""
_NOISE = int.from_bytes(b"noise")
"""Added to the run's seed, so that noise is not drawn from the same stream as a sample's start."""


@dataclass(frozen=True)
class FlightEvaluation(Evaluation):
    """Flights of several laws, or of one over its parameters, through stages that come nearer to the truth.

    A design point has one flight in the stages ``ideal`` and ``sampled``, `noise_samples` in ``noisy`` and
    ``nonlinear``, which differ in their noise, and `samples` in ``dispersed``. Nothing is optimised; the run concludes
    with what survives. Settling times are infinite for bands that were not kept for the last half orbit. `status` is
    ``ok``, ``unsettled`` (so it is for the band by which flights are judged), ``unstable`` (the ideal loop is),
    ``diverged``, or ``failed`` (the law cannot be sampled, or no memory be chosen for a marginal loop).

    Raises:
        ArgumentError: a stage, a measure or a value of a law is unknown, flights cannot be judged by the band, or the
            plant has no units.
    """

    laws: Mapping[str, NamedLaw] = field(default_factory=dict)
    """By the names they have in tables and figures; none for the one law."""
    stages: tuple[Stage, ...] = STAGES
    sampling: Sampling = field(default_factory=Sampling)
    surroundings: Surroundings | None = None
    """None for the plant alone, with nothing that disturbs."""
    band_m: float | Mapping[str, float] = 100.0
    """The settling band by which flights are judged, one for all starts or by their names."""
    noise_samples: int = 50
    samples: int = 500
    first_sample: int = 0
    """Number of the first; any sample can be flown again by its number."""
    seed: int = 0
    sizes: Mapping[str, uncertain.Size] = field(default_factory=dict)
    """What per cents of offsets are of, by initial condition; those of the states where none are given."""

    @property
    def has_poles(self) -> bool:
        """Never: most flights are not those of a linear loop."""
        return False

    def __post_init__(self) -> None:
        if self.plant.scales is None:
            raise ArgumentError(
                "plant", type(self.plant).__name__, "must have units for flights", "set plant.scales, or take plant=hcw"
            )
        check_laws(self.laws, self.plant.components)
        history.check(self.sampling.history_orbits, self.around.truth)
        for stage in self.stages:
            if stage not in STAGES:
                allowed = f"must be among {', '.join(STAGES)}{suggestion(stage, STAGES)}"
                raise ArgumentError("stages", stage, allowed)
        if getattr(self.solver, "cross_check", 0.0):
            raise ArgumentError("solver.cross_check", self.solver.cross_check, "has no second solver of flights; set 0")
        for measure in self.measures:
            if not takes(measure):
                allowed = f"cannot be taken of flights; choose among {', '.join(names())}"
                raise ArgumentError("measures", measure.name, allowed)
        measured_columns = self.measured_columns
        for band in self.bands_m.values():
            if conclusion.settling_column(band) not in measured_columns:
                allowed = "must be one of the measured bands, measures.settling_times.thresholds_m"
                raise ArgumentError("band_m", f"{band:g}", allowed)

    @cached_property
    def bands_m(self) -> dict[str, float]:
        """The band by which flights are judged, by their start."""
        if not isinstance(self.band_m, Mapping):
            return dict.fromkeys(self.initial_conditions, self.band_m)
        for missing in set(self.initial_conditions) - set(self.band_m):
            raise ArgumentError("band_m", dict(self.band_m), f"must hold a band for {missing}")
        return {condition: self.band_m[condition] for condition in self.initial_conditions}

    @cached_property
    def around(self) -> Surroundings:
        """What flights meet."""
        return self.surroundings or Surroundings(self.plant)

    @cached_property
    def flights(self) -> tuple[tuple[Stage, int], ...]:
        """Stage and sample of every flight of a design point, in their order."""
        counts = {"dispersed": self.samples, "noisy": self.noise_samples, "nonlinear": self.noise_samples}
        several = {stage: counts.get(stage, 1) for stage in self.stages}
        return tuple(
            (stage, self.first_sample + number if stage not in CERTAIN else 0)
            for stage, count in several.items()
            for number in range(count)
        )

    @cached_property
    def axes(self) -> Mapping[str, Floats]:
        """The number of the law, where there are several, and that of the flight."""
        laws = {LAW_NUMBER: np.arange(len(self.laws), dtype=np.float64)} if self.laws else {}
        return laws | {FLIGHT: np.arange(len(self.flights), dtype=np.float64)}

    @cached_property
    def design_variables(self) -> tuple[str, ...]:
        """The parameters of the one law, or the number of the law."""
        return (LAW_NUMBER,) if self.laws else super().design_variables

    @cached_property
    def row_columns(self) -> tuple[str, ...]:
        """Columns of the rows, in order."""
        named = (LAW,) if self.laws else ()
        where = (STAGE, FLIGHT, SAMPLE, *self.around.dispersions)
        tail = (rows_of.LIMITED, "status", "stable", "error_estimate", *COUNTERS)
        return ("initial_condition", *named, *self.design_variables, *where, *self.measured_columns, *tail)

    def loop(self, design: Mapping[str, Floats | float]) -> ClosedLoop:
        """Return the ideal loop of the one law, or of the law with the number in `design` (the first without)."""
        if not self.laws:
            return super().loop(design)
        named = list(self.laws.values())[int(np.ravel(design.get(LAW_NUMBER, 0.0))[0])]
        return ClosedLoop(self.plant, named.law.from_parameters(self.plant.components, dict(named.values)))

    def __call__(self, design: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the rows of b design points: all points of the first initial condition, then of the next."""
        points = self._points({name: np.asarray(values, dtype=np.float64) for name, values in design.items()})
        drawn = {n: np.where(points.stages == "dispersed", v, np.nan) for n, v in points.drawn.items()}
        own: dict[str, Array] = {
            **points.designs,
            STAGE: points.stages,
            FLIGHT: points.numbers,
            SAMPLE: points.samples,
        } | drawn
        if self.laws:
            own[LAW] = np.array(list(self.laws), dtype=object)[points.designs[LAW_NUMBER].astype(int)]
        tables = []
        for condition in self.initial_conditions:
            parts = [part for places in points.by_design() for part in self._of_law(points, places, condition)]
            order = np.argsort(np.concatenate([places for places, _ in parts]))
            rows = {name: values[order] for name, values in joined([rows for _, rows in parts]).items()}
            tables.append({"initial_condition": np.full(len(order), condition, dtype=object)} | own | rows)
        rows = joined(tables)
        return {name: rows[name] for name in self.row_columns}

    def _points(self, table: dict[str, Floats]) -> _Points:
        numbers = table.pop(FLIGHT)
        flights = [self.flights[int(number)] for number in numbers]
        samples = np.array([sample for _, sample in flights], dtype=np.float64)
        stages = np.array([stage for stage, _ in flights], dtype=object)
        designs = table if self.laws else self._full_design(table)
        return _Points(designs, numbers, stages, samples, self.around.drawn(samples))

    def _of_law(self, points: _Points, places: Array, condition: str) -> Iterator[tuple[Array, dict[str, Array]]]:
        """Yield the measures of the flights of one law from one start that stand at `places`, part by part."""
        loop = self.loop({name: float(values[places[0]]) for name, values in points.designs.items()})
        if assess(loop).stable is False:
            yield places, rows_of.of_none(len(places), self.measured_columns, "unstable")
            return
        try:
            controller = self.sampling.law(loop).discrete(self.plant.n_controls)
        except UnsupportedError:
            yield places, rows_of.of_none(len(places), self.measured_columns, "failed")
            return
        band = self.bands_m[condition]
        for stage in dict.fromkeys(points.stages[places].tolist()):
            inside = places[points.stages[places] == stage]
            for first in range(0, len(inside), _ABREAST):
                at = inside[first : first + _ABREAST]
                if stage == "ideal":
                    found = self.solver.solve(loop, self.initial_conditions[condition][None], self.horizon)
                    yield at, rows_of.of_ideal(found, self.measures, band)
                else:
                    drawn = {name: values[at] for name, values in points.drawn.items()}
                    met = self._met(condition, stage, drawn, len(at))
                    flight = self._flown(controller, met, points.samples[at])
                    yield at, rows_of.of_sampled(flight, met, self.measures, band)

    def _met(self, condition: str, stage: Stage, drawn: Mapping[str, Floats], count: int) -> Flown:
        return self.around.of(stage, self.initial_conditions[condition], drawn, count, self.sizes.get(condition))

    def _flown(self, controller: DiscreteController, met: Flown, samples: Floats) -> SampledTrajectory:
        numbers = [int(sample) for sample in samples]
        return simulate(
            met.plant,
            controller,
            met.states,
            self.horizon,
            actuator=met.actuator,
            navigation=met.navigation,
            anti_windup=self.sampling.anti_windup,
            earlier=history.recorded(
                met.plant,
                met.states,
                met.navigation,
                controller.period,
                self.sampling.history_orbits,
                self.seed + _NOISE,
                numbers,
            ),
            seed=self.seed + _NOISE,
            numbers=numbers,
        )

    def fly(
        self,
        initial_condition: str,
        stage: Stage = "dispersed",
        samples: Iterable[int] = (0,),
        design: Mapping[str, float] | None = None,
    ) -> SampledTrajectory:
        """Return flights of a law by the numbers of their samples, for a closer look.

        Args:
            initial_condition: name of the start.
            stage: any but ``ideal``.
            samples: their numbers.
            design: parameters of the law, or ``law_number``; the configured law without.
        """
        if stage not in STAGES[1:]:
            raise ArgumentError("stage", stage, f"must be one of {', '.join(STAGES[1:])}")
        numbers = np.array(list(samples), dtype=np.float64)
        controller = self.sampling.law(self.loop(design or {})).discrete(self.plant.n_controls)
        met = self._met(initial_condition, stage, self.around.drawn(numbers), len(numbers))
        return self._flown(controller, met, numbers)

    def conclude(self, parts: Iterable[Mapping[str, Array]]) -> Conclusion:
        """Return what survives of every law, stage by stage; all of laws with one flight at the last stage."""
        rows = joined(list(parts))
        varied = [name for name in self.design_variables if name != LAW_NUMBER and np.unique(rows[name]).size > 1]
        groups = ["initial_condition", *([LAW] if self.laws else varied)]
        found = conclusion.conclude(rows, groups, self.measured_columns, self.bands_m)
        if not varied and np.isin(rows[STAGE], CERTAIN).any():
            laws = Implementations(self.loop, self.sampling, self.around.navigation)
            found = found.beside(IMPLEMENTATIONS, list(laws.records(rows, self.measured_columns)))
        alone = [stage for stage, _ in self.flights].count(self.stages[-1]) == 1
        return self._with_paths(rows, found) if self.laws and alone else found

    def _with_paths(self, rows: Mapping[str, Array], found: Conclusion) -> Conclusion:
        last = self.stages[-1]
        laws = {single_flights.LAWS: single_flights.records(rows, self.measured_columns, last)}
        paths = list(single_flights.paths(rows, last, partial(self._path, last)))
        tables = {**found.tables, **laws, **({single_flights.PATHS: paths} if paths else {})}
        return replace(found, tables=tables, shown=laws | dict(found.shown if len(self.stages) > 1 else {}))

    def _path(self, stage: Stage, design: Mapping[str, float], start: str) -> dict[str, Floats]:
        if stage == "ideal":
            times = np.linspace(0.0, self.horizon, self.trajectory_samples)
            return {"time": times} | self.sampled(self.solve(design, start), times)
        number = next(sample for other, sample in self.flights if other == stage)
        flight: Any = replace(self.fly(start, stage, [number], design), batched=False)
        return {"time": flight.switching_times} | self.sampled(flight, flight.switching_times)


@dataclass(frozen=True)
class _Points:
    """Design points: whose law they are, and which of its flights."""

    designs: Mapping[str, Floats]
    numbers: Floats
    stages: Array
    samples: Floats
    drawn: Mapping[str, Floats]

    def by_design(self) -> Iterator[Array]:
        """Yield the places of points of the same design."""
        _, inverse = np.unique(np.column_stack(list(self.designs.values())), axis=0, return_inverse=True)
        for number in range(inverse.max() + 1):
            yield np.flatnonzero(inverse.ravel() == number)
