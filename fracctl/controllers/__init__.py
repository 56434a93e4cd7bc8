"""Control laws."""

from fracctl.controllers.adaptive_delay import AdaptiveDelayedFeedback
from fracctl.controllers.delayed_feedback import DelayedFeedback, DelayedLaw, DelayedSum, DelayedTerm
from fracctl.controllers.linear import LinearLaw, LinearLawTerms
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pd import PD
from fracctl.controllers.pd_alpha import PDAlpha
from fracctl.controllers.pd_lag import PDLag
from fracctl.controllers.pdd_alpha import PDDAlpha
from fracctl.controllers.pi_lambda_d_mu import PILambdaDMu
from fracctl.controllers.pid import PID
from fracctl.controllers.saturation import Saturation

__all__ = [
    "PD",
    "PID",
    "AdaptiveDelayedFeedback",
    "DelayedFeedback",
    "DelayedLaw",
    "DelayedSum",
    "DelayedTerm",
    "LinearLaw",
    "LinearLawTerms",
    "PDAlpha",
    "PDDAlpha",
    "PDLag",
    "PILambdaDMu",
    "Parameter",
    "Saturation",
]
