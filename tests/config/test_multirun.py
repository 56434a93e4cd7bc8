"""`-m`: Hydra's grammar of sweeps, expanded before anything runs."""

from __future__ import annotations

import pytest

from fracctl.config.compose import expand_multirun
from fracctl.errors import UsageError


@pytest.mark.parametrize(
    ("words", "jobs"),
    [
        ([], [[]]),
        (["a=1"], [["a=1"]]),
        (["a=1,2"], [["a=1"], ["a=2"]]),
        (["a=1,2", "b=x,y"], [["a=1", "b=x"], ["a=1", "b=y"], ["a=2", "b=x"], ["a=2", "b=y"]]),
        (["a=choice(1,2)", "c=0"], [["a=1", "c=0"], ["a=2", "c=0"]]),
        (["a=range(0.93,0.96,0.01)"], [["a=0.93"], ["a=0.94"], ["a=0.95"]]),
        (["a=range(1,3)"], [["a=1"], ["a=2"]]),
        (["a=[1,2],[3]"], [["a=[1,2]"], ["a=[3]"]]),
        (["a='x,y'"], [["a='x,y'"]]),
        (["~a"], [["~a"]]),
        (["++a=1,2"], [["++a=1"], ["++a=2"]]),
        (["experiment=glob(ic*_outofplane)"], [[f"experiment=ic{i}_outofplane"] for i in (1, 2, 3)]),
        (["initial_condition=[ic1],[ic1,ic2]"], [["initial_condition=[ic1]"], ["initial_condition=[ic1,ic2]"]]),
    ],
)
def test_sweeps_become_jobs(words: list[str], jobs: list[list[str]]) -> None:
    assert expand_multirun(words) == jobs


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("experiment=glob(nothing*)", "names no run"),
        ("a=range(3,1)", "names no run"),
        ("a=range(0,1,0)", "cannot read"),
        ("a=range(0,1e9)", "more than 10000 runs"),
        ("a=interval(0,1)", "has no list of values"),
        ("a", "neither an override, KEY=VALUE"),
    ],
)
def test_sweeps_that_are_none(word: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        expand_multirun([word])


def test_the_product_of_sweeps_is_limited() -> None:
    with pytest.raises(UsageError, match="axes of a survey"):
        expand_multirun(["a=range(0,200)", "b=range(0,200)"])
