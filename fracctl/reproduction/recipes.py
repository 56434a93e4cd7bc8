"""Where in a run's optima a published number is found; data, read from ``suite.yaml``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from fracctl.config.fields import Strict

if TYPE_CHECKING:
    import pandas as pd


class Point(Strict):
    """One row of a run's optima."""

    initial_condition: str
    objective: str
    kind: Literal["overall", "baseline", "slice"]
    """The best point of all, of those with the baseline's values, or of one slice."""
    where: dict[str, float] = Field(default_factory=dict)
    """Values that columns have, for kinds of which there are several."""
    experiment: str | None = None
    """Whose optima; None for the section's."""


class Recipe(Strict):
    """How a number is made of optima: a column, or the change of a column between two points."""

    column: str
    at: str | list[str]
    """Name of a point; of several, the smallest value counts."""
    increase_over: str | None = None
    """A point: the number is value / its value - 1."""
    reduction_from: str | None = None
    """A point: the number is 1 - value / its value."""

    @model_validator(mode="after")
    def _one_change(self) -> Recipe:
        if self.increase_over is not None and self.reduction_from is not None:
            raise PydanticCustomError("refused", "has either increase_over or reduction_from")
        return self

    @property
    def points(self) -> list[str]:
        """Names of the points the number is made of."""
        named = [self.at] if isinstance(self.at, str) else self.at
        return [*named, *(point for point in (self.increase_over, self.reduction_from) if point is not None)]


class RunOptima:
    """The optima of a section's runs.

    Args:
        points: what their names stand for.
        tables: optima by experiment.
        experiment: of points that name none.
    """

    def __init__(self, points: Mapping[str, Point], tables: Mapping[str, pd.DataFrame], experiment: str) -> None:
        self._points, self._tables, self._experiment = points, tables, experiment

    def number(self, recipe: Recipe) -> float | None:
        """Return what a recipe makes, dimensionless; None where a point has no optimum."""
        named = [recipe.at] if isinstance(recipe.at, str) else recipe.at
        values = [self._value(name, recipe.column) for name in named]
        if any(value is None for value in values):
            return None
        value = min(value for value in values if value is not None)
        reference = recipe.increase_over or recipe.reduction_from
        if reference is None:
            return value
        base = self._value(reference, recipe.column)
        if not base or (math.isinf(value) and math.isinf(base)):
            return None
        change = value / base - 1.0
        return change if recipe.increase_over else -change

    def _value(self, name: str, column: str) -> float | None:
        point = self._points[name]
        table = self._tables[point.experiment or self._experiment]
        wanted = {
            "initial_condition": point.initial_condition,
            "objective_name": point.objective,
            "kind": point.kind,
            **point.where,
        }
        if not {column, *wanted} <= set(table.columns):
            return None
        for key, value in wanted.items():
            table = table[table[key] == value]
        found = table[column].astype("Float64").dropna()
        return float(found.iloc[0]) if len(found) and not math.isnan(found.iloc[0]) else None
