"""From design points to rows for laws with a memory in the loop: one law over its parameters, or several laws."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fracctl.arrays import Array, Floats, joined
from fracctl.dispersions import SAMPLE, Distribution, check_names, draws, spreads
from fracctl.errors import ArgumentError, suggestion
from fracctl.evaluation import COUNTERS, LAW_NUMBER, Conclusion, Evaluation, ParametrisedLaw, geometric_mean
from fracctl.loop import ClosedLoop
from fracctl.measures.tethers import targets
from fracctl.plants.capabilities import control_events, names_dispersed

if TYPE_CHECKING:
    from fracctl.meshwise import MeshTrajectory

LAW = "law"
LAWS, QUANTILES = "laws", "quantiles"
"""Names of the tables."""
MOST_BESIDE = 8
"""Points from each start that are shown beside each other."""
SAMPLES_IN_PERIOD = 1000
"""Of a stored trajectory, in 2π of time."""
_INITIAL = "initial_"


@dataclass(frozen=True)
class NamedLaw:
    """A law among several."""

    law: type[ParametrisedLaw]
    values: Mapping[str, float] = field(default_factory=dict)
    """Values of its parameters; their defaults where none are given."""


def check_laws(laws: Mapping[str, NamedLaw], components: Sequence[str]) -> None:
    """Raise ArgumentError unless the values of laws name their parameters."""
    for name, given in laws.items():
        known = [parameter.name for parameter in given.law.parameters(components)]
        for wrong in set(given.values) - set(known):
            allowed = f"must name parameters of the law ({', '.join(known)}){suggestion(wrong, known)}"
            raise ArgumentError(f"laws.{name}.values", wrong, allowed)


@dataclass(frozen=True)
class MemoryEvaluation(Evaluation):
    """How a design point becomes a row for each initial condition, for laws with a memory in the loop.

    With several `laws` the design variable is their number, and rows name the law. With `dispersions` there is a row
    for each sample; nothing is optimised, and the run concludes with quantiles. The status of a row is that of its run:
    ``ok``, ``unsettled`` where a measure of an objective is infinite, the name of the plant's event that ended it,
    ``diverged`` or ``failed``.

    Raises:
        ArgumentError: a dispersion names neither a state nor a number of the plant that can be dispersed, a law's value
            names no parameter; or as `Evaluation`.
    """

    laws: Mapping[str, NamedLaw] = field(default_factory=dict)
    """By the names they have in tables and figures; none for the one law."""
    dispersions: Mapping[str, Distribution] = field(default_factory=dict)
    """By name: ``initial_<state>`` stands for a state at time 0, others for numbers of the plant."""
    samples: int = 1
    """How many of them."""
    first_sample: int = 0
    """Number of the first; any sample can be drawn again by its number."""
    seed: int = 0

    @property
    def has_poles(self) -> bool:
        """Never: the law is not linear."""
        return False

    def __post_init__(self) -> None:
        if not self.dispersed:
            super().__post_init__()
        check_laws(self.laws, self.plant.components)
        check_names(self.dispersions, self._known)

    @property
    def _known(self) -> list[str]:
        """Names of what may be uncertain."""
        return [*(f"{_INITIAL}{name}" for name in self.plant.state_names), *names_dispersed(self.plant)]

    @property
    def dispersed(self) -> bool:
        """Whether numbers are drawn at random."""
        return bool(self.dispersions)

    @cached_property
    def axes(self) -> Mapping[str, Floats]:
        """The number of the law and that of the sample, where there are several."""
        axes: dict[str, Floats] = {LAW_NUMBER: np.arange(len(self.laws), dtype=np.float64)} if self.laws else {}
        if self.dispersed:
            axes[SAMPLE] = self.first_sample + np.arange(self.samples, dtype=np.float64)
        return axes

    @property
    def sliced_by(self) -> str | None:
        """The axis for each value of which an optimum is kept, where the survey names none."""
        return LAW_NUMBER if self.laws and not self.dispersed else None

    @cached_property
    def design_variables(self) -> tuple[str, ...]:
        """The parameters of the one law, or the number of the law."""
        return (LAW_NUMBER,) if self.laws else super().design_variables

    @cached_property
    def row_columns(self) -> tuple[str, ...]:
        """Columns of the rows, in order."""
        measured = tuple(column for measure in self.measures for column in measure.columns)
        named = (LAW,) if self.laws else ()
        drawn = (SAMPLE, *self.dispersions) if self.dispersed else ()
        optimised = () if self.dispersed else ("objective", *(f"objective_{name}" for name in self.objectives))
        tail = ("status", "stable", "error_estimate", *COUNTERS)
        return ("initial_condition", *named, *self.design_variables, *drawn, *measured, *optimised, *tail)

    def loop(self, design: Mapping[str, Floats | float]) -> ClosedLoop:
        """Return the closed loop of the one law, of a batch where `design` holds arrays, or of the first law."""
        return self._loop(design, self.plant)

    def _loop(self, design: Mapping[str, Floats | float], plant: Any) -> ClosedLoop:
        if self.laws:
            number = int(np.ravel(design.get(LAW_NUMBER, 0.0))[0])
            law, values = list(self.laws.values())[number].law, dict(list(self.laws.values())[number].values)
        else:
            law, values = self.law, {**self.parameters, **design}  # type: ignore[dict-item]
        made: Any = law.from_parameters(plant.components, values)
        return ClosedLoop(plant, made)

    def __call__(self, design: Mapping[str, Floats]) -> dict[str, Array]:
        """Return the rows of b design points: all points of the first initial condition, then of the next."""
        table = {name: np.asarray(values, dtype=np.float64) for name, values in design.items()}
        b, names = len(next(iter(table.values()))), list(self.initial_conditions)
        samples = table.pop(SAMPLE, np.zeros(b))
        if not self.laws:
            table = self._full_design(table)
        drawn = draws(self.dispersions, self._known, self.seed, [int(sample) for sample in samples])
        parts = []
        for name in names:
            states = self._starts(self.initial_conditions[name], drawn, b)
            measured = self._solved(table, drawn, states)
            parts.append({"initial_condition": np.full(b, name, dtype=object), **table, SAMPLE: samples} | measured)
        rows = joined([part | drawn for part in parts])
        if self.laws:
            known = np.array(list(self.laws), dtype=object)
            rows[LAW] = known[rows[LAW_NUMBER].astype(int)]
        return {name: rows[name] for name in self.row_columns}

    def _starts(self, nominal: Floats, drawn: Mapping[str, Floats], b: int) -> Floats:
        states = np.repeat(nominal[None], b, axis=0)
        for place, state in enumerate(self.plant.state_names):
            if (values := drawn.get(f"{_INITIAL}{state}")) is not None:
                states[:, place] = values
        return states

    def _solved(self, table: Mapping[str, Floats], drawn: Mapping[str, Floats], states: Floats) -> dict[str, Array]:
        """Return the measures of b points, each on a mesh of its own: a row depends on its point alone."""
        parts = []
        for place in np.arange(len(states))[:, None]:
            loop = self._loop(_taken(table, place), self._plant(_taken(drawn, place)))
            parts.append(self._measured(self._solver.solve(loop, states[place], self.horizon)))
        return joined(parts)

    def _plant(self, drawn: Mapping[str, Floats]) -> Any:
        own = {name: values for name, values in drawn.items() if not name.startswith(_INITIAL)}
        plant: Any = self.plant
        return plant.dispersed_by(**own) if own else plant

    @property
    def _solver(self) -> Any:
        return self.solver

    def _measured(self, trajectory: Any) -> dict[str, Array]:
        values: dict[str, Array] = {}
        for measure in self.measures:
            values |= measure(trajectory)
        rows, status = dict(values), trajectory.status.copy()
        if not self.dispersed:
            means = {name: geometric_mean([values[c] for c in columns]) for name, columns in self.objectives.items()}
            rows |= {"objective": means[self.objective]} | {f"objective_{name}": mean for name, mean in means.items()}
            status[(status == "ok") & ~np.isfinite(means[self.objective])] = "unsettled"
        rows |= {"status": status, "stable": np.full(len(status), None, dtype=object)}
        rows |= {"error_estimate": trajectory.error_estimate}
        return rows | dict.fromkeys(COUNTERS, trajectory.counters["steps"])

    def solve(  # type: ignore[override]
        self, design: Mapping[str, float], initial_condition: str, horizon: float | None = None
    ) -> MeshTrajectory:
        """Return the trajectory of one design point, over `horizon` or the evaluation's own."""
        state = self.initial_conditions[initial_condition]
        trajectory: MeshTrajectory = self._solver.solve(self._loop(design, self.plant), state, horizon or self.horizon)
        return trajectory

    @property
    def trajectory_samples(self) -> int:
        """How many times of a trajectory are stored."""
        return max(2001, 1 + int(SAMPLES_IN_PERIOD * self.horizon / (2.0 * np.pi)))

    @property
    def trajectory_kinds(self) -> tuple[str, ...]:
        """Kinds of optima whose trajectories are stored."""
        return ("slice",) if self.laws else ("slice", *super().trajectory_kinds)

    @property
    def sampled_columns(self) -> tuple[str, ...]:
        """Columns of stored trajectories: states, controls, what the law would have liked to give, and its target."""
        further = (f"{what}_{component}" for what in ("demand", "target") for component in self.plant.components)
        return (*super().sampled_columns, *further)

    def sampled(self, trajectory: Any, times: Floats) -> dict[str, Floats]:
        """Return the `sampled_columns` of a single trajectory at times (t,), (t,) each."""
        wanted = np.repeat(targets(trajectory), len(times), axis=0)
        samples = np.column_stack([trajectory(times), trajectory.control(times), trajectory.demand(times), wanted])
        return dict(zip(self.sampled_columns, samples.T, strict=True))

    def conclude(self, parts: Iterable[Mapping[str, Array]]) -> Conclusion:
        """Return quantiles of a dispersed run, a table of the laws or points if there are few; and why runs ended."""
        rows = joined(list(parts))
        measured = [column for measure in self.measures for column in measure.columns]
        varied = [name for name in self.design_variables if name != LAW_NUMBER and np.unique(rows[name]).size > 1]
        exact = f"memory: relative error of its kernel at most {self._solver.memory_tolerance:g}, a-priori"
        notes = [*self._endings(rows), exact]
        if self.dispersed:
            groups = ["initial_condition", *([LAW] if self.laws else []), *varied]
            records = list(spreads(rows, groups, measured))
            return Conclusion({QUANTILES: records}, {QUANTILES: records}, (*self._notes(rows, groups), *notes))
        if len(rows["status"]) > MOST_BESIDE * len(self.initial_conditions) or not (self.laws or varied):
            return Conclusion(notes=tuple(notes))
        names = rows[LAW].tolist() if self.laws else _labels(rows, varied)
        columns = {"initial_condition": rows["initial_condition"], LAW: names}
        columns |= {name: rows[name] for name in (*measured, "status")}
        values = zip(*(list(np.asarray(c, dtype=object)) for c in columns.values()), strict=True)
        records = [dict(zip(columns, row, strict=True)) for row in values]
        return Conclusion({LAWS: records}, {LAWS: records}, tuple(notes))

    def _endings(self, rows: Mapping[str, Array]) -> Iterator[str]:
        events = {event.name: event.meaning for event in (*self.plant.events, *control_events(self.plant))}
        for word in dict.fromkeys(rows["status"].tolist()):
            if word in events:
                count = int((rows["status"] == word).sum())
                yield f"{count} of {len(rows['status'])} runs ended in {word}: {events[word] or word}"

    def _notes(self, rows: Mapping[str, Array], named: list[str]) -> Iterator[str]:
        keys = list(zip(*(rows[name].tolist() for name in named), strict=True))
        for key in dict.fromkeys(keys):
            words = rows["status"][[place for place, other in enumerate(keys) if other == key]]
            bad = [f"{int((words == word).sum())} {word}" for word in dict.fromkeys(words.tolist()) if word != "ok"]
            yield f"{len(words)} samples of {', '.join(map(str, key))}" + (f": {', '.join(bad)}" if bad else ", all ok")


def _labels(rows: Mapping[str, Array], varied: list[str]) -> list[str]:
    values = zip(*(rows[name].tolist() for name in varied), strict=True)
    return [", ".join(f"{name} = {value:g}" for name, value in zip(varied, row, strict=True)) for row in values]


def _taken(table: Mapping[str, Floats], places: Array) -> dict[str, Floats]:
    return {name: values[places] for name, values in table.items()}
