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
from fracctl.flight import beside, conclusion, history
from fracctl.flight.implementations import IMPLEMENTATIONS, Implementations
from fracctl.flight.measured import measured, names, takes
from fracctl.flight.names import CERTAIN, STAGES, Stage
from fracctl.flight.stages import Flown, Sampling, Surroundings
from fracctl.loop import ClosedLoop
from fracctl.memory_evaluation import LAW, NamedLaw, check_laws
from fracctl.sampled import DiscreteController, SampledTrajectory, simulate
from fracctl.stability import assess

FLIGHT, STAGE = "flight", "stage"
LIMITED = "limited_percent"
"""Column of the share of periods in which the thrusters were at their limit."""
_ABREAST = 256
"""Flights of a batch: their states are kept at all samples."""
_NOISE = int.from_bytes(b"noise")
"""Added to the run's seed, so that noise is not drawn from the same stream as a sample's start."""


@dataclass(frozen=True)
class FlightEvaluation(Evaluation):
    """Flights of several laws, or of one over its parameters, through stages that come nearer to the truth.

    A design point has one flight in the stages ``ideal`` and ``sampled``, `noise_samples` in ``noisy`` and
    ``nonlinear``, which differ in their noise, and `samples` in ``dispersed``. Nothing is optimised; the run concludes
    with what survives. `status` is ``ok``, ``unsettled`` (outside the band by which flights are judged at the horizon),
    ``unstable`` (the ideal loop is), ``diverged``, or ``failed`` (the law cannot be sampled, or no memory be
    chosen for a marginal loop).

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

    @property
    def has_poles(self) -> bool:
        """Never: most flights are not those of a linear loop."""
        return False

    def __post_init__(self) -> None:
        if self.plant.scales is None:
            raise ArgumentError("plant", self.plant, "must have units for flights; set plant.scales")
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
        tail = (LIMITED, "status", "stable", "error_estimate", *COUNTERS)
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
        uncertain = {n: np.where(points.stages == "dispersed", v, np.nan) for n, v in points.drawn.items()}
        own: dict[str, Array] = {
            **points.designs,
            STAGE: points.stages,
            FLIGHT: points.numbers,
            SAMPLE: points.samples,
        } | uncertain
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
            yield places, self._not_flown(len(places), "unstable")
            return
        try:
            controller = self.sampling.law(loop).discrete(self.plant.n_controls)
        except UnsupportedError:
            yield places, self._not_flown(len(places), "failed")
            return
        for stage in dict.fromkeys(points.stages[places].tolist()):
            inside = places[points.stages[places] == stage]
            for first in range(0, len(inside), _ABREAST):
                at = inside[first : first + _ABREAST]
                if stage == "ideal":
                    yield at, self._ideal(loop, condition)
                else:
                    drawn = {name: values[at] for name, values in points.drawn.items()}
                    met = self.around.of(stage, self.initial_conditions[condition], drawn, len(at))
                    yield at, self._measured(self._flown(controller, met, points.samples[at]), condition)

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
        nominal = self.initial_conditions[initial_condition]
        return self._flown(
            controller, self.around.of(stage, nominal, self.around.drawn(numbers), len(numbers)), numbers
        )

    def _ideal(self, loop: ClosedLoop, condition: str) -> dict[str, Array]:
        found = self.solver.solve(loop, self.initial_conditions[condition][None], self.horizon)
        rows: dict[str, Array] = {}
        for measure in self.measures:
            rows |= measure(found)
        status = self._told(found.status.copy(), rows, condition)
        rows |= {LIMITED: np.zeros(1), "status": status, "stable": found.stable}
        return rows | {"error_estimate": found.error_estimate} | {name: found.counters[name] for name in COUNTERS}

    def _measured(self, flight: SampledTrajectory, condition: str) -> dict[str, Array]:
        rows: dict[str, Array] = {}
        for measure in self.measures:
            rows |= measured(measure, flight)
        b, periods = flight.commands.shape[:2]
        rows |= {LIMITED: 100.0 * flight.saturated_share, "status": self._told(flight.status.copy(), rows, condition)}
        rows |= {"stable": np.full(b, None, dtype=object), "error_estimate": np.full(b, np.nan)}
        return rows | dict.fromkeys(COUNTERS, np.full(b, periods))

    def _told(self, status: Array, rows: Mapping[str, Array], condition: str) -> Array:
        status[(status == "ok") & ~np.isfinite(rows[conclusion.settling_column(self.bands_m[condition])])] = "unsettled"
        return status

    def _not_flown(self, count: int, word: str) -> dict[str, Array]:
        rows: dict[str, Array] = {name: np.full(count, np.inf) for name in self.measured_columns}
        rows |= {LIMITED: np.full(count, np.nan), "status": np.full(count, word, dtype=object)}
        rows |= {
            "stable": np.full(count, False if word == "unstable" else None, dtype=object),
            "error_estimate": np.full(count, np.nan),
        }
        return rows | dict.fromkeys(COUNTERS, np.zeros(count, dtype=np.int64))

    def conclude(self, parts: Iterable[Mapping[str, Array]]) -> Conclusion:
        """Return what survives of every law, stage by stage; of laws with one flight a stage, all that is measured."""
        rows = joined(list(parts))
        varied = [name for name in self.design_variables if name != LAW_NUMBER and np.unique(rows[name]).size > 1]
        groups = ["initial_condition", *([LAW] if self.laws else varied)]
        found = conclusion.conclude(rows, groups, self.measured_columns, self.bands_m)
        if not varied and np.isin(rows[STAGE], CERTAIN).any():
            laws = Implementations(self.loop, self.sampling, self.around.navigation)
            found = found.beside(IMPLEMENTATIONS, list(laws.records(rows, self.measured_columns)))
        return self._beside(rows, found) if self.laws and len(self.flights) == len(self.stages) else found

    def _beside(self, rows: Mapping[str, Array], found: Conclusion) -> Conclusion:
        last = self.stages[-1]
        laws = {beside.LAWS: beside.measured(rows, self.measured_columns, last)}
        paths = list(beside.paths(rows, last, self.horizon, partial(self._path, last)))
        tables = {**found.tables, **laws, **({beside.PATHS: paths} if paths else {})}
        return replace(found, tables=tables, shown=laws | dict(found.shown if len(self.stages) > 1 else {}))

    def _path(self, stage: Stage, design: Mapping[str, float], start: str, times: Floats) -> dict[str, Floats]:
        if stage == "ideal":
            return self.sampled(self.solve(design, start), times)
        number = next(sample for other, sample in self.flights if other == stage)
        flight: Any = replace(self.fly(start, stage, [number], design), batched=False)
        return self.sampled(flight, np.minimum(times, flight.horizon))


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
