"""Control laws."""

from fracctl.controllers.linear import LinearLaw, LinearLawTerms
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pd import PD
from fracctl.controllers.pd_alpha import PDAlpha

__all__ = ["PD", "LinearLaw", "LinearLawTerms", "PDAlpha", "Parameter"]
