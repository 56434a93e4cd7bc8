"""The call that draws a run's figures; their types are in the registry of names."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from fracctl.config import registry
from fracctl.errors import ConfigurationError, FracctlError
from fracctl.figures.results import FigureError, Results, Selection, select
from fracctl.figures.style import FILES, render, style
from fracctl.store import RunDirectory
from fracctl.store.files import make_directory, write_bytes


@dataclass(frozen=True)
class _Request:
    name: str
    build: Callable[[Results, Selection], tuple[Figure, pd.DataFrame]]
    selection: Selection


@dataclass(frozen=True)
class Drawing:
    """A figure for a page, and the table behind it."""

    name: str
    about: str
    """What figures of its type show."""
    svg: bytes
    table: pd.DataFrame


def draw(
    run: RunDirectory, figures: Mapping[str, Mapping[str, Any]], remark: str = "", folder: Path | None = None
) -> list[Path]:
    """Draw figures of a stored run: ``<name>.pdf``, ``<name>.png`` and the table behind them, ``<name>.csv``.

    Args:
        run: the run directory; nothing else is read.
        figures: file name to type and options, as in the configuration's `figures`.
        remark: what stands below each figure, e.g. that the run lacks points.
        folder: where they are written; None for the run's own.

    Returns:
        The files written.

    Raises:
        ConfigurationError: a type or an option is unknown.
        FigureError: the run does not hold what a figure shows; the other figures are written all the same.
    """
    results = Results(run)
    written: list[Path] = []
    problems: list[FracctlError] = []
    for request in [_request(results, name, options) for name, options in figures.items()]:
        try:
            written += _files(folder or run.figures, request, results, remark)
        except FigureError as problem:
            problems.append(FigureError(f"figure '{request.name}': {problem}"))
    if problems:
        raise FigureError("\n".join(str(problem) for problem in problems))
    return written


def drawing(run: RunDirectory, name: str, options: Mapping[str, Any]) -> Drawing:
    """Draw one figure of a stored run for a page.

    Raises:
        ConfigurationError, FigureError: as `draw`.
    """
    results = Results(run)
    request = _request(results, name, options)
    contents, table = _drawn(request, results, ("svg",))
    about = (sys.modules[request.build.__module__].__doc__ or "").partition("\n")[0]
    return Drawing(name, about, contents["svg"], table)


def _request(results: Results, name: str, options: Mapping[str, Any]) -> _Request:
    others = {key: value for key, value in options.items() if key != "type"}
    kind = str(options.get("type"))
    try:
        build = registry.load("figures", kind)
    except ConfigurationError as problem:
        raise ConfigurationError(f"figures.{name}.type = {kind}: {problem}") from None
    try:
        return _Request(name, build, select(results, others))
    except ConfigurationError as problem:
        raise ConfigurationError(f"figures.{name}: {problem}") from None


def _files(folder: Path, request: _Request, results: Results, remark: str) -> list[Path]:
    contents, table = _drawn(request, results, FILES, remark)
    contents["csv"] = table.to_csv(index=False, lineterminator="\n").encode()
    make_directory(folder)
    paths = []
    for kind, content in contents.items():
        paths.append(folder / f"{request.name}.{kind}")
        write_bytes(paths[-1], content)
    return paths


def _drawn(
    request: _Request, results: Results, kinds: Sequence[str], remark: str = ""
) -> tuple[dict[str, bytes], pd.DataFrame]:
    with style():
        figure, table = request.build(results, request.selection)
        return render(figure, kinds, remark), table
