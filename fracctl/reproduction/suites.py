"""The suites: a folder of ``experiments/`` for each paper, with ``suite.yaml`` and ``published.csv``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml
from pydantic import Field, ValidationError

from fracctl.config.fields import Strict
from fracctl.config.yaml_traps import traps
from fracctl.errors import ConfigurationError
from fracctl.reproduction.published import PublishedRow, read_published
from fracctl.reproduction.recipes import Point, Recipe

_PACKAGE = Path(__file__).resolve().parent.parent


class Section(Strict):
    """A part of a paper: the experiment that computes it, and where its numbers are found."""

    title: str
    experiment: str
    """Name of the experiment whose exact measures stand beside the published numbers."""
    sampling: list[str]
    """Overrides that give the experiment the paper's sampling."""
    points: dict[str, Point] = Field(min_length=1)
    rows: dict[str, Recipe] = Field(min_length=1)
    """Recipes by the id of the published row."""

    @property
    def experiments(self) -> list[str]:
        """Names of all experiments."""
        named = (point.experiment for point in self.points.values())
        return list(dict.fromkeys([self.experiment, *(name for name in named if name is not None)]))


class _SuiteFile(Strict):
    paper: str
    sections: dict[str, Section] = Field(min_length=1)


@dataclass(frozen=True)
class Suite:
    """A paper: its sections and its published numbers."""

    name: str
    """Of its folder."""
    paper: str
    """Authors and title."""
    sections: Mapping[str, Section]
    published: Mapping[str, PublishedRow]
    """By id."""

    def rows(self, section: str) -> list[tuple[PublishedRow, Recipe]]:
        """Return the published rows of a section with their recipes, in the order of ``published.csv``."""
        recipes = self.sections[section].rows
        return [(row, recipes[row.id]) for row in self.published.values() if row.id in recipes]


def suites_directory() -> Path:
    """``fracctl/experiments`` of an installed wheel, else ``experiments`` of the checkout."""
    packaged = _PACKAGE / "experiments"
    return packaged if packaged.is_dir() else _PACKAGE.parent / "experiments"


def suite_names(directory: Path | None = None) -> list[str]:
    """Names of all papers, sorted."""
    return sorted(path.parent.name for path in (directory or suites_directory()).glob("*/suite.yaml"))


def read_suite(name: str, directory: Path | None = None) -> Suite:
    """Read the suite of a paper.

    Raises:
        ConfigurationError: a file is missing or wrong, or rows and recipes do not belong together.
    """
    folder = (directory or suites_directory()) / name
    path = folder / "suite.yaml"
    content = _validated(path)
    published = {row.id: row for row in read_published(folder / "published.csv")}
    problems = list(_problems(content, published))
    if problems:
        raise ConfigurationError("\n".join(f"{path}: {problem}" for problem in problems))
    return Suite(name, content.paper, content.sections, published)


def _validated(path: Path) -> _SuiteFile:
    try:
        if trapped := traps(path):
            raise ConfigurationError("\n".join(trapped))
        return _SuiteFile.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        lines = [f"{path}: {'.'.join(map(str, line['loc']))}: {line['msg']}" for line in error.errors()]
        raise ConfigurationError("\n".join(lines)) from error
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{path} is not YAML: {error}") from error
    except OSError as problem:
        raise ConfigurationError(f"cannot read {path}: {problem.strerror}") from problem


def _problems(content: _SuiteFile, published: Mapping[str, PublishedRow]) -> Iterator[str]:
    seen: set[str] = set()
    for name, section in content.sections.items():
        for row, recipe in section.rows.items():
            where = f"sections.{name}.rows.{row}"
            if row not in published:
                yield f"{where}: published.csv has no such row"
            if row in seen:
                yield f"{where}: another section has it too"
            seen.add(row)
            yield from (f"{where}: there is no point '{p}'" for p in recipe.points if p not in section.points)
    yield from (f"the published row '{row}' is in no section" for row in published if row not in seen)
