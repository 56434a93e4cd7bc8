"""Surveys: which design points to evaluate, in blocks, and which of them are optima; no files, no processes."""

from fracctl.surveys.axes import axis_values
from fracctl.surveys.base import Block, Search, Survey
from fracctl.surveys.continuation import Continuation, PatternSearchSurvey
from fracctl.surveys.grid import Grid
from fracctl.surveys.lqr_seed import LQRSeed, LQRWeights
from fracctl.surveys.optima import Optima
from fracctl.surveys.pattern_search import PatternSearch
from fracctl.surveys.search import PopulationSearch
from fracctl.surveys.single import Single

__all__ = [
    "Block",
    "Continuation",
    "Grid",
    "LQRSeed",
    "LQRWeights",
    "Optima",
    "PatternSearch",
    "PatternSearchSurvey",
    "PopulationSearch",
    "Search",
    "Single",
    "Survey",
    "axis_values",
]
