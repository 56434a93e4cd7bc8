"""Runs of the fake evaluation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from fracctl.execution.computation import Job
from fracctl.execution.worker import Work
from fracctl.store import identity
from fracctl.surveys import Grid, Survey, axis_values

FACTORY = "tests.execution.fake_evaluation:evaluation"
AXES = {"alpha_w": "0.8:1.0:0.05", "k_p_w": "0:2:0.1", "k_d_w": "0:2:0.1"}
N_POINTS = 5 * 21 * 21
N_BLOCKS = 5


def fix_identity(patch: pytest.MonkeyPatch) -> None:
    """Take the sources of the package for unchanged."""
    patch.setattr(identity, "sources_digest", lambda: "fixed")


def grid(axes: Mapping[str, str] = AXES) -> Survey:
    return Grid({name: axis_values(spec) for name, spec in axes.items()}, slice="alpha_w", baseline={"alpha_w": 1.0})


def job(output_dir: Path, scheduler: Mapping[str, Any] | None = None, seed: int = 0, **data: Any) -> Job:
    """A run of the fake; `seed` gives it another id, faults do not."""
    configuration = {
        "name": "fake",
        "output_dir": str(output_dir),
        "scheduler": dict(scheduler or {"type": "serial"}),
        "figures": {},
        "seed": seed,
    }
    return Job(configuration, Work.of(FACTORY, data), grid)
