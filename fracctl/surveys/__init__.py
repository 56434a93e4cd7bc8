"""Surveys: which design points to evaluate, in blocks, and which of them are optima; no files, no processes.

Searches are loaded at first use: what they come with takes its time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.lazy import loaded_at_first_use
from fracctl.surveys.axes import axis_values
from fracctl.surveys.base import Block, Search, Survey
from fracctl.surveys.grid import Grid
from fracctl.surveys.single import Single

if TYPE_CHECKING:
    from fracctl.surveys.continuation import Continuation, PatternSearchSurvey
    from fracctl.surveys.lqr_seed import LQRSeed, LQRWeights
    from fracctl.surveys.optima import Optima
    from fracctl.surveys.pattern_search import PatternSearch
    from fracctl.surveys.search import PopulationSearch

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


__getattr__ = loaded_at_first_use(
    __name__,
    {
        "Continuation": "continuation",
        "PatternSearchSurvey": "continuation",
        "LQRSeed": "lqr_seed",
        "LQRWeights": "lqr_seed",
        "Optima": "optima",
        "PatternSearch": "pattern_search",
        "PopulationSearch": "search",
    },
)
