"""Figures of stored runs, as vector PDF and PNG with the table behind each; they read the store only."""

from fracctl.figures.drawing import Drawing, draw, drawing
from fracctl.figures.results import FigureError

__all__ = ["Drawing", "FigureError", "draw", "drawing"]
