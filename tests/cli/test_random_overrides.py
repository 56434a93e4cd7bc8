"""Whatever stands on the command line: exit code 0, 2 or 3, and never a traceback."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fracctl.cli.main import main
from fracctl.config.catalogue import catalogue
from fracctl.config.compose import compose

FOUND = catalogue()


BASES = ("outofplane", "ic1_inplane_search", "fair_outofplane", "libration", "tether_monte_carlo", "nonlinear_ic1")
"""Experiments of every kind of survey and evaluation."""


def leaves(data: object, path: str = "") -> dict[str, object]:
    """All dotted keys of plain data, with their values."""
    if not isinstance(data, dict):
        return {}
    found: dict[str, object] = {}
    for key, value in data.items():
        own = f"{path}.{key}".removeprefix(".")
        found |= {own: value} | leaves(value, own)
    return found


LEAVES = {name: leaves(compose([f"experiment={name}"]).model_dump(mode="json")) for name in BASES}
KEYS = list(dict.fromkeys(key for found in LEAVES.values() for key in found))
CHOICES = [f"{group}={option}" for group in FOUND.groups() for option in FOUND.options(group)]

values = st.one_of(
    st.sampled_from(["null", "true", "0", "1", "-1", "0.5", "1e-3", "1e400", "nan", "inf", "''", "[]", "{}", "[1,2]"]),
    st.sampled_from(
        ["a,b", "range(1,3)", "glob(*)", "0:2:0.5", "0:2:-1", "{a: 1}", "[a,[b]]", "${seed}", "${x}", "???"]
    ),
    st.floats().map(str),
    st.text(max_size=8),
)
keys = st.one_of(
    st.sampled_from(KEYS),
    st.sampled_from(FOUND.groups()),
    st.sampled_from(KEYS).map(lambda key: f"{key}x"),
    st.sampled_from(KEYS).map(lambda key: f"{key}.y"),
    st.text(max_size=8),
)
assignments = st.builds(
    lambda prefix, key, value: f"{prefix}{key}={value}", st.sampled_from(["", "+", "++"]), keys, values
)
words = st.one_of(st.sampled_from(CHOICES), assignments, keys.map(lambda key: f"~{key}"), st.text(max_size=10))


def near(base: str) -> st.SearchStrategy[str]:
    """Words that change a number of an experiment a little; many of them are valid."""
    numbers = {
        key: float(value)
        for key, value in LEAVES[base].items()
        if isinstance(value, int | float) and not isinstance(value, bool)
    }
    factors = st.sampled_from([0.5, 0.9, 1.0, 1.1, 2.0, -1.0])
    return st.builds(lambda key, factor: f"{key}={numbers[key] * factor:g}", st.sampled_from(list(numbers)), factors)


def with_base(base: str) -> st.SearchStrategy[list[str]]:
    further = st.lists(st.one_of(words, near(base), near(base)), max_size=4)
    return further.map(lambda found: [f"experiment={base}", *found])


overrides_of_runs = st.sampled_from(BASES).flatmap(with_base)


def check(overrides: list[str]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        said: list[str] = []
        patch.setattr("fracctl.cli.output._write", lambda stream, text: said.append(text))
        code = main(["validate", *overrides])
    text = "".join(said)
    assert code in (0, 2, 3), (overrides, text)
    assert "Traceback" not in text
    assert "a fault of fracctl" not in text
    assert text.startswith("valid: " if code == 0 else "error: "), (overrides, text)


@settings(max_examples=100)
@given(overrides_of_runs)
def test_validate_never_shows_a_traceback(overrides: list[str]) -> None:
    check(overrides)


@pytest.mark.slow
@settings(max_examples=1000)
@given(overrides_of_runs)
def test_a_thousand_lists_of_overrides_never_show_a_traceback(overrides: list[str]) -> None:
    check(overrides)


@settings(max_examples=30)
@given(st.lists(words, max_size=3))
def test_a_sweep_is_refused_or_expanded(overrides: list[str]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        said: list[str] = []
        patch.setattr("fracctl.cli.output._write", lambda stream, text: said.append(text))
        code = main(["run", "-m", "--cfg", "job", *overrides])
    assert code in (0, 2, 3), (overrides, "".join(said))
