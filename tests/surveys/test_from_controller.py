"""Searches that begin with a known point: it is in the first generation, and never lost."""

from __future__ import annotations

import numpy as np
import pytest

from fracctl.config.build import build_checked
from fracctl.config.compose import compose
from fracctl.errors import ConfigurationError

WORDS = ["experiment=ic1_inplane_search", "survey.starts=2", "survey.population=8", "survey.evaluations=8"]
KNOWN = {"k_p_u": 4.0, "k_p_uv": -1.35, "k_p_vu": 3.15, "k_p_v": 0.4, "k_d_u": 2.4, "k_d_uv": 0.65}
GIVEN = [f"controller.{name}={value}" for name, value in KNOWN.items()]


def test_the_controller_is_the_first_point_of_every_start() -> None:
    for words, same in ((["survey.from_controller=true"], True), ([], False)):
        _, survey = build_checked(compose([*WORDS, *GIVEN, "survey.baseline=null", *words]))
        (block,) = survey.ask()
        for name, value in KNOWN.items():
            assert (block.design[name] == value).all() == same


def test_a_search_is_no_worse_than_where_it_begins() -> None:
    """Of 8 random gains in [-20, 20] hardly one is stable; the published ones are among them."""
    words = ["survey.bounds.gains=[-20,20]", "survey.from_controller=true", "survey.baseline=null"]
    evaluation, survey = build_checked(compose([*WORDS, *GIVEN, *words]))
    (block,) = survey.ask()
    rows = block.search(evaluation, block.design)
    alone = evaluation({name: values[:1] for name, values in block.design.items()})
    assert rows["objective"][rows["status"] == "ok"].min() <= alone["objective"][0]
    assert np.isfinite(alone["objective"][0])


def test_a_controller_outside_the_bounds_is_refused() -> None:
    words = ["survey.from_controller=true", "survey.bounds.gains=[-1,1]"]
    with pytest.raises(ConfigurationError, match=r"controller\.k_p_u = 4 within its bounds \[-1, 1\]"):
        build_checked(compose([*WORDS, *GIVEN, *words]))
