"""Control laws."""

from fracctl.controllers.linear import LinearLaw, LinearLawTerms
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pd_alpha import PDAlpha

__all__ = ["LinearLaw", "LinearLawTerms", "PDAlpha", "Parameter"]
