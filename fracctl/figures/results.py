"""What the figures read: the tables of a run directory, and the part of them that one figure shows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import pandas as pd

from fracctl.config import registry
from fracctl.config.options import construct, typed_options_of
from fracctl.errors import ConfigurationError, RunError, suggestion
from fracctl.figures import labels
from fracctl.store import RunDirectory
from fracctl.units import Scales

Row = Mapping[str, Any]
"""A row of optima, by column."""
_Builder = TypeVar("_Builder", bound=Callable[..., Any])

_DESIGN = (
    "alpha_",
    "lambda_",
    "mu_",
    "time_constant_",
    "k_",
    "gain_",
    "beta",
    "delay",
    "recall",
    "switch_on_delays",
    "adapt",
)
"""What columns of design variables begin with."""
_OPTIONS = ("objective", "initial_conditions", "shows", "stage")
_IN_ORBIT = ("tether", "libration", "relative_motion", "tschauner_hempel", "perturbed_relative_motion")
"""Plants whose time 2π is an orbit."""


class FigureError(RunError):
    """A figure cannot be drawn from what the run holds."""


@dataclass(frozen=True)
class Results:
    """The tables of one run, read when first asked for."""

    run: RunDirectory

    @cached_property
    def configuration(self) -> dict[str, Any]:
        """The run's resolved configuration."""
        configuration: dict[str, Any] = self.run.run_json["configuration"]
        return configuration

    @cached_property
    def evaluations(self) -> pd.DataFrame:
        """All evaluated points."""
        return self.run.evaluations()

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Columns of the evaluated points."""
        return self.run.evaluations_columns

    @cached_property
    def optima(self) -> pd.DataFrame:
        """Optima by kind: slice, overall, baseline; the row's number is the `run` of a trajectory."""
        return self.run.optima()

    @cached_property
    def trajectories(self) -> pd.DataFrame:
        """States and controls of the points that figures show."""
        return self.run.trajectories()

    @cached_property
    def poles(self) -> pd.DataFrame:
        """Poles and pseudo-state eigenvalues of the points that figures show."""
        return self.run.poles()

    @cached_property
    def frequency_response(self) -> pd.DataFrame:
        """Loop gains and sensitivities of the points that figures show."""
        return self.run.frequency_response()

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Names of the controlled positions."""
        columns = map(str, self.trajectories.columns)
        return tuple(name.removeprefix("control_") for name in columns if name.startswith("control_"))

    @property
    def slice_variable(self) -> str | None:
        """The design variable by whose values a grid is cut into slices."""
        name: str | None = self.configuration["survey"].get("slice")
        return name

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Design variables, the slices' apart, of which the table holds more than one value."""
        axes = self.configuration["survey"].get("axes", {})
        names = [name for name in axes if name != self.slice_variable]
        return tuple(name for name in names if self.run.varies(name))

    @property
    def horizon_periods(self) -> float:
        """Length of each trajectory in periods 2π."""
        given = self.configuration
        if given.get("horizon_periods") is not None:
            return float(given["horizon_periods"])
        assert self.scales is not None
        seconds = given["horizon_s"] if given["horizon_min"] is None else 60.0 * given["horizon_min"]
        return float(seconds) / self.scales.period_s

    @property
    def threshold(self) -> float | None:
        """Half width δ of the band of the settling time; None where it is not measured."""
        measure = self.configuration["measures"].get("settling_time")
        return None if measure is None else float(measure["threshold"])

    @property
    def period_name(self) -> str:
        """What 2π of the dimensionless time is called."""
        kind = str(self._plant["type"])
        if kind == "rotating_ellipsoid":
            return "rotations of the body"
        return "orbits" if kind.startswith("hcw") or kind in _IN_ORBIT else "periods $2\\pi$"

    @property
    def time_name(self) -> str:
        """What the dimensionless time is called."""
        named = {"libration": "True anomaly $\\nu$ (rad)", "linear": "Time $s$"}
        kind = str(self._plant["type"])
        return "Time $s$" if kind.startswith("hcw") else named.get(kind, "Time $t$")

    @cached_property
    def flies_laws(self) -> bool:
        """Whether the run has flown several laws and kept their paths."""
        evaluation = self.configuration.get("evaluation") or {}
        return evaluation.get("type") == "flight" and (self.run.path / "paths.parquet").exists()

    @cached_property
    def scales(self) -> Scales | None:
        """Lengths and times in SI units, where the plant has them."""
        scales: Scales | None = self.plant.scales
        return scales

    @cached_property
    def plant(self) -> Any:
        """The plant of the run."""
        factory = registry.load("plants", self._plant["type"])
        return construct(factory, typed_options_of(factory).model_validate(self._plant))

    @property
    def _plant(self) -> dict[str, Any]:
        plant: dict[str, Any] = self.configuration["plant"]
        return plant


@dataclass(frozen=True)
class Selection:
    """The objective and the initial conditions that a figure shows."""

    objective: str
    """Name of the objective."""
    columns: tuple[str, ...]
    """Measures whose geometric mean it is."""
    initial_conditions: tuple[str, ...]
    """Names, in the order of the rows of the figure."""
    shows: str | None = None
    """What figures that can show several things show; None for what they show by themselves."""
    stage: str | None = None
    """Of flights, the stage that is shown; None for the last."""

    @property
    def value_column(self) -> str:
        """Column of the objective in evaluations and optima."""
        return f"objective_{self.objective}"


def showing(words: Iterable[str] | None) -> Callable[[_Builder], _Builder]:
    """Declare what the option `shows` of a figure may be; a builder without this has no such option.

    Args:
        words: one of these; None for measures of the run, separated by commas.
    """
    known = None if words is None else tuple(words)

    def declare(build: _Builder) -> _Builder:
        vars(build)["shows"] = known
        return build

    return declare


def select(results: Results, options: Mapping[str, Any]) -> Selection:
    """Read the options `objective` (default: the primary), `initial_conditions` (default: all), `shows` and `stage`.

    Raises:
        ConfigurationError: an option or a name is unknown.
    """
    for key in options:
        if key not in _OPTIONS:
            raise ConfigurationError(f"unknown option '{key}'{suggestion(key, _OPTIONS)}")
    objectives = results.configuration["objectives"]
    objective = options.get("objective") or results.configuration["objective"]
    _known("objective", [objective], objectives)
    present = list(results.configuration["initial_condition"])
    asked = options.get("initial_conditions") or present
    _known("initial condition", asked, present)
    return Selection(objective, tuple(objectives[objective]), tuple(asked), options.get("shows"), options.get("stage"))


def optimum(results: Results, selection: Selection, initial_condition: str, kind: str) -> Row | None:
    """Return the row of optima of this kind (overall, baseline) with its number as `run`, None if there is none."""
    rows = chosen(results.optima, selection, initial_condition, kind)
    if rows.empty:
        return None
    return {"run": rows.index[0]} | {str(name): value for name, value in rows.iloc[0].items()}


def chosen(optima: pd.DataFrame, selection: Selection, initial_condition: str, kind: str) -> pd.DataFrame:
    """Rows of optima of one kind for the selected objective and one initial condition."""
    objective = optima["objective_name"] == selection.objective
    return optima[objective & (optima["initial_condition"] == initial_condition) & (optima["kind"] == kind)]


def objective_scale(results: Results, selection: Selection) -> tuple[float, str]:
    """What the objective is divided by on an axis, and the axis' label: settling times are shown in periods."""
    words = labels.objective(selection.columns)
    return (math.tau, f"{words} ({results.period_name})") if selection.columns == ("settling_time",) else (1.0, words)


def same_point(first: Row, second: Row) -> bool:
    """Whether two rows are the same design point."""
    names = [name for name in first if name.startswith(_DESIGN)]
    return all(first[name] == second[name] for name in names)


def _known(what: str, names: Sequence[str], known: Mapping[str, Any] | Sequence[str]) -> None:
    for name in names:
        if name not in known:
            raise ConfigurationError(f"the run has no {what} '{name}'{suggestion(name, known)}")
