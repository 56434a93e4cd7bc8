"""Drawing the figures of a stored run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fracctl.store.files import disk_errors, move, remove_tree
from fracctl.store.run_directory import RunDirectory

UNDRAWN = "undrawn_figures"
"""Key of a summary: a sentence for each figure that the run does not hold the data of; they are notes too."""


def draw_figures(directory: RunDirectory, figures: Mapping[str, Mapping[str, Any]], remark: str = "") -> list[str]:
    """Draw figures, each with a remark, and return a sentence for each that the run does not hold the data of.

    They are drawn beside those that are there, and take their place when all are done.

    Raises:
        RunError: the disk is full or cannot be written to; the figures that were there stay.
    """
    remove_tree(directory.new_figures)
    problems = _drawn(directory, figures, remark) if figures else []
    remove_tree(directory.figures)
    if directory.new_figures.exists():
        move(directory.new_figures, directory.figures)
    return problems


def _drawn(directory: RunDirectory, figures: Mapping[str, Mapping[str, Any]], remark: str) -> list[str]:
    from fracctl.figures import FigureError, draw  # loads matplotlib

    try:
        with disk_errors(directory.new_figures):
            draw(directory, figures, remark, directory.new_figures)
    except FigureError as problem:
        return str(problem).splitlines()
    return []
