"""Figures of stored runs, as vector PDF and PNG with the table behind each; they read the store only."""

from fracctl.figures.drawing import draw
from fracctl.figures.results import FigureError

__all__ = ["FigureError", "draw"]
