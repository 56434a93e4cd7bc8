"""A fair comparison of control laws: the same problems, searches, budgets, bounds and seeds for all of them."""

from fracctl.comparison.compared import ComparedLaw
from fracctl.comparison.evaluation import ComparisonEvaluation
from fracctl.comparison.survey import Comparison

__all__ = ["ComparedLaw", "Comparison", "ComparisonEvaluation"]
