"""Control laws.

Laws with compiled kernels are loaded at first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fracctl.controllers.adaptive_delay import AdaptiveDelayedFeedback
from fracctl.controllers.delayed_feedback import DelayedFeedback, DelayedLaw, DelayedSum, DelayedTerm
from fracctl.controllers.linear import LinearLaw, LinearLawTerms
from fracctl.controllers.memory import MemoryLaw
from fracctl.controllers.parameters import Parameter
from fracctl.controllers.pd import PD
from fracctl.controllers.pd_alpha import PDAlpha
from fracctl.controllers.pd_lag import PDLag
from fracctl.controllers.pdd_alpha import PDDAlpha
from fracctl.controllers.pi_lambda_d_mu import PILambdaDMu
from fracctl.controllers.pid import PID
from fracctl.controllers.references import Approach
from fracctl.controllers.saturation import Saturation
from fracctl.lazy import loaded_at_first_use

if TYPE_CHECKING:
    from fracctl.controllers.fractional_sliding_mode import FractionalSlidingMode
    from fracctl.controllers.sliding_mode import AdaptiveSlidingMode

__all__ = [
    "PD",
    "PID",
    "AdaptiveDelayedFeedback",
    "AdaptiveSlidingMode",
    "Approach",
    "DelayedFeedback",
    "DelayedLaw",
    "DelayedSum",
    "DelayedTerm",
    "FractionalSlidingMode",
    "LinearLaw",
    "LinearLawTerms",
    "MemoryLaw",
    "PDAlpha",
    "PDDAlpha",
    "PDLag",
    "PILambdaDMu",
    "Parameter",
    "Saturation",
]

__getattr__ = loaded_at_first_use(
    __name__,
    {
        "AdaptiveSlidingMode": "sliding_mode",
        "FractionalSlidingMode": "fractional_sliding_mode",
    },
)
