"""One section of a paper: run its experiments, find its numbers, judge them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

from fracctl.config.command import Command
from fracctl.config.compose import compose
from fracctl.config.schemas import RunConfig
from fracctl.errors import RunError
from fracctl.execution.executors import Executors
from fracctl.execution.progress import Progress
from fracctl.execution.run import RunResult, execute
from fracctl.reproduction.published import REPRODUCED, UNITS, WORDS, PublishedRow
from fracctl.reproduction.recipes import Recipe, RunOptima
from fracctl.reproduction.suites import Section, Suite
from fracctl.reproduction.verdicts import judge

SAMPLED, EXACT = SAMPLINGS = ("sampled", "exact")


@dataclass(frozen=True)
class Row:
    """A published row, what was computed, and the verdict."""

    published: PublishedRow
    computed: float | None
    """With the paper's sampling, in the row's unit; None where there is no such optimum."""
    exact: float | None
    """With exact measures, in the row's unit."""
    difference: Decimal | None
    """Computed, with one digit more than printed, less published."""
    verdict: str

    @property
    def fails(self) -> bool:
        """Whether it must hold and does not."""
        return self.published.expected == REPRODUCED != self.verdict

    @property
    def surprises(self) -> bool:
        """Whether it comes out although that is not expected."""
        return self.published.expected != REPRODUCED == self.verdict


@dataclass(frozen=True)
class Reproduction:
    """The rows of a section, and the runs they come from."""

    paper: str
    section: str
    title: str
    rows: tuple[Row, ...]
    runs: Mapping[str, Mapping[str, RunResult]]
    """By sampling (``sampled``, ``exact``) and experiment."""
    directory: Path
    """Where its table belongs, below the output directory of the runs; absolute."""

    @property
    def name(self) -> str:
        """``paper/section``."""
        return f"{self.paper}/{self.section}"

    @property
    def counts(self) -> dict[str, int]:
        """Number of rows by verdict."""
        found = Counter(row.verdict for row in self.rows)
        return {word: found[word] for word in WORDS}

    @property
    def failures(self) -> list[Row]:
        """Rows that must hold and do not."""
        return [row for row in self.rows if row.fails]


def reproduce(
    suite: Suite,
    section: str,
    overrides: Sequence[str] = (),
    progress: Callable[[str], Progress] | None = None,
    executors: Executors | None = None,
) -> Reproduction:
    """Run the experiments of a section, with the paper's sampling and exact, and compare with what is published.

    Stored runs are used again. Figures are those of the exact runs.

    Args:
        suite: the paper.
        section: its name.
        overrides: of both runs, e.g. a coarser grid.
        progress: makes a progress display from a label.
        executors: lend worker processes to all runs; None for each its own.

    Raises:
        ConfigurationError: an experiment does not exist or an override is wrong.
        RunError: a run failed, or some of its points did.
    """
    wanted = suite.sections[section]
    settings: dict[str, Sequence[str]] = {SAMPLED: wanted.sampling, EXACT: ()}
    runs: dict[str, dict[str, RunResult]] = {sampling: {} for sampling in SAMPLINGS}
    for sampling, words in settings.items():
        for name in wanted.experiments:
            display = progress(f"{name}, {sampling}") if progress else None
            chosen = [f"experiment={name}", *words, *overrides]
            config = compose(chosen)
            drawn = config.model_copy(update={"figures": {}}) if words else config
            runs[sampling][name] = _run(name, drawn, Command.of(chosen), display, executors)
    sampled, exact = (_optima(wanted, runs[sampling]) for sampling in SAMPLINGS)
    rows = tuple(_row(published, recipe, sampled, exact) for published, recipe in suite.rows(section))
    output = runs[EXACT][wanted.experiment].run_directory.parents[1]
    return Reproduction(suite.name, section, wanted.title, rows, runs, output / "reproduce" / suite.name / section)


def _run(
    experiment: str, config: RunConfig, command: Command, progress: Progress | None, executors: Executors | None
) -> RunResult:
    result = execute(config, command=command, progress=progress, executors=executors)
    if error := result.summary.get("error"):
        raise RunError(f"{experiment}: {error}")
    return result


def _optima(section: Section, runs: Mapping[str, RunResult]) -> RunOptima:
    return RunOptima(section.points, {name: run.optima for name, run in runs.items()}, section.experiment)


def _row(published: PublishedRow, recipe: Recipe, sampled: RunOptima, exact: RunOptima) -> Row:
    numbers = (optima.number(recipe) for optima in (sampled, exact))
    computed, truth = (None if number is None else number / UNITS[published.unit] for number in numbers)
    verdict = judge(published, computed)
    return Row(published, computed, truth, verdict.difference, verdict.word)
