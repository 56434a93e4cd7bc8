"""Drawing the figures of a stored run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fracctl.store.files import disk_errors
from fracctl.store.run_directory import RunDirectory


def draw_figures(directory: RunDirectory, figures: Mapping[str, Mapping[str, Any]], remark: str = "") -> list[str]:
    """Draw figures, each with a remark, and return a sentence for each that the run does not hold the data of."""
    if not figures:
        return []
    from fracctl.figures import FigureError, draw  # loads matplotlib

    try:
        with disk_errors(directory.figures):
            draw(directory, figures, remark)
    except FigureError as problem:
        return str(problem).splitlines()
    return []
