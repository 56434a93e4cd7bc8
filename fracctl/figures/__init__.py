"""Figures of stored runs, as vector PDF and PNG with the table behind each; they read the store only."""

from fracctl.figures.registry import TYPES, Drawing, draw, drawing
from fracctl.figures.results import FigureError

__all__ = ["TYPES", "Drawing", "FigureError", "draw", "drawing"]
