"""The evaluation of a configuration, as workers build it."""

from __future__ import annotations

from typing import Any

from fracctl.config.build import build_evaluation
from fracctl.config.schemas import RunConfig
from fracctl.evaluation import Evaluation


def evaluation_of(plain: dict[str, Any]) -> Evaluation:
    """Build the evaluation of a plain configuration."""
    return build_evaluation(RunConfig.model_validate(plain))
