"""How far the solvers are off, and what they cost: trajectories against references that another method computed."""

from fracctl.accuracy.evaluation import AccuracyEvaluation
from fracctl.accuracy.references import References
from fracctl.accuracy.settings import Setting, settings

__all__ = ["AccuracyEvaluation", "References", "Setting", "settings"]
