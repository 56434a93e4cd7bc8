"""A stored run as a report reads it: what its directory says, and what is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fracctl.config.command import Command
from fracctl.config.schemas import RunConfig
from fracctl.errors import FracctlError, RunError
from fracctl.figures.results import Results
from fracctl.report.numbers import number
from fracctl.store import RunDirectory
from fracctl.store.columns import DIMENSIONLESS, unit

_MISSING = ("no optimum", "no baseline", "failed", "damaged", "disagree", "could not", "figure '")
"""What notes say on results that are missing or not to be trusted."""
_ENDINGS = {
    "running": "it is being computed, or was killed",
    "interrupted": "it was interrupted",
    "failed": "it failed",
    "incomplete": "some of its points could not be computed",
}


@dataclass(frozen=True)
class StoredRun:
    """One run directory, finished or not."""

    directory: RunDirectory

    @classmethod
    def read(cls, path: Path) -> StoredRun:
        """Return the run of a directory.

        Raises:
            RunError: it holds no run.
        """
        if not path.is_dir():
            what = "is a file" if path.exists() else "does not exist"
            raise RunError(
                f"'{path}' {what}; a report is made of the directories of runs, as 'fracctl list runs' names them"
            )
        if not (path / "run.json").exists():
            below = sorted(path.glob("*/run.json")) or sorted(path.glob("*/*/run.json"))
            cure = (
                f"; did you mean '{below[0].parent}'?"
                if below
                else "; 'fracctl list runs' names the runs below outputs/"
            )
            raise RunError(f"'{path}' holds no run: it has no run.json{cure}")
        run = cls(RunDirectory(path))
        if not isinstance(run.content.get("configuration"), dict) or "name" not in run.configuration:
            raise RunError(f"'{path}' holds no run: its run.json has no configuration")
        return run

    @cached_property
    def content(self) -> dict[str, Any]:
        """What ``run.json`` holds."""
        return self.directory.run_json

    @property
    def configuration(self) -> dict[str, Any]:
        """The resolved configuration."""
        configuration: dict[str, Any] = self.content["configuration"]
        return configuration

    @property
    def provenance(self) -> dict[str, Any]:
        """Versions, commit, machine and times."""
        return dict(self.content.get("provenance") or {})

    @property
    def summary(self) -> dict[str, Any]:
        """As ``--json`` prints it; empty of a run that has come to none."""
        return dict(self.content.get("summary") or {})

    @property
    def status(self) -> str:
        """A word: finished, incomplete, running, interrupted, failed."""
        return str(self.content.get("status"))

    @property
    def name(self) -> str:
        """Name of the experiment."""
        return str(self.configuration["name"])

    @property
    def run_id(self) -> str:
        """The run's id, which its directory is named by."""
        return str(self.summary.get("run_id") or self.directory.path.name)

    @cached_property
    def config(self) -> RunConfig | None:
        """The configuration as this version of the program reads it; None where it does not fit it any more."""
        try:
            return RunConfig.model_validate(self.configuration)
        except (ValidationError, FracctlError):
            return None

    @cached_property
    def command(self) -> Command | None:
        """What started the run; None where it was not recorded."""
        try:
            return Command.model_validate(self.content.get("command"))
        except ValidationError:
            return None

    @property
    def results(self) -> list[dict[str, Any]]:
        """Optimum and baseline by objective, the primary one first, and initial condition."""
        return list(self.summary.get("optima") or ())

    @property
    def tables(self) -> dict[str, list[dict[str, Any]]]:
        """What the evaluation makes of all rows, by the name of its table."""
        return dict(self.summary.get("tables") or {})

    @property
    def notes(self) -> list[str]:
        """Notes on the result."""
        return list(self.summary.get("notes") or ())

    @cached_property
    def alerts(self) -> list[str]:
        """What a reader must know before all else: an end too early, damage, results that are missing."""
        return list(self._alerts())

    def _alerts(self) -> Iterator[str]:
        if self.status != "finished":
            ending = _ENDINGS.get(self.status, f"its status is {self.status}")
            yield f"This run is not finished: {ending}."
        if error := self.summary.get("error") or self.content.get("error"):
            yield f"{error}"
        if self.directory.has_manifest:
            yield from (f"Not as the run wrote it: {damage}." for damage in self.directory.verify())
        yield from (note for note in self.notes if any(word in note for word in _MISSING))

    def value_of(self, objective: str, value: float | None) -> str:
        """Return the value of an objective with its unit; a settling time in orbits and hours."""
        factors = self.configuration["objectives"].get(objective, [])
        word = unit(factors[0]) if len(factors) == 1 else DIMENSIONLESS
        is_time = len(factors) == 1 and factors[0].startswith("settling_time") and word == DIMENSIONLESS
        if value is None or not math.isfinite(value):
            return "never" if is_time else "without bound"
        if is_time:
            return self.time(value)
        return number(value, 4) + ("" if word == DIMENSIONLESS else f" {word}")

    def time(self, value: float) -> str:
        """Return a dimensionless time in the plant's periods and in hours."""
        results = Results(self.directory)
        name = results.period_name.replace("periods $2\\pi$", "periods of 2π")
        periods = f"{number(value / math.tau, 4)} {name}"
        hours = None if results.scales is None else value * results.scales.time_s / 3600.0
        return periods if hours is None else f"{periods} ({number(hours, 4)} h)"

    def design(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """Return the values of a row that tell its law from others: those of design variables, or the law's name."""
        if isinstance(row.get("law"), str):
            return {"law": row["law"]}
        axes = self.configuration["survey"].get("axes", {})
        names = [name for name in row if name in self.configuration["controller"] or name in _FACTORS]
        varied = [name for name in row if name in axes] or names
        return {name: row[name] for name in varied if len(varied) <= _MOST_NAMED or name.startswith(_ORDERS)}


_FACTORS = ("gain_factor",)
_MOST_NAMED = 6
"""Of a law with more parameters than this, a sentence names the orders and time constants only."""
_ORDERS = ("alpha_", "lambda_", "mu_", "nu", "time_constant_")
