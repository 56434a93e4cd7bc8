"""Whatever stands on the command line: exit code 0, 2 or 3, and never a traceback."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fracctl.cli.main import main
from fracctl.config.catalogue import catalogue
from fracctl.config.compose import compose

FOUND = catalogue()


def paths(data: object, path: str = "") -> list[str]:
    """All dotted keys of plain data."""
    if not isinstance(data, dict):
        return []
    own = [f"{path}.{key}".removeprefix(".") for key in data]
    return own + [deeper for key, value in data.items() for deeper in paths(value, f"{path}.{key}".removeprefix("."))]


KEYS = paths(compose(["experiment=outofplane"]).model_dump(mode="json"))
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


@settings(max_examples=100)
@given(st.lists(words, max_size=4))
def test_validate_never_shows_a_traceback(overrides: list[str]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        said: list[str] = []
        patch.setattr("fracctl.cli.output._write", lambda stream, text: said.append(text))
        code = main(["validate", "experiment=outofplane", *overrides])
    text = "".join(said)
    assert code in (0, 2, 3), (overrides, text)
    assert "Traceback" not in text
    assert text.startswith("valid: " if code == 0 else "error: "), (overrides, text)


@settings(max_examples=30)
@given(st.lists(words, max_size=3))
def test_a_sweep_is_refused_or_expanded(overrides: list[str]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        said: list[str] = []
        patch.setattr("fracctl.cli.output._write", lambda stream, text: said.append(text))
        code = main(["run", "-m", "--cfg", "job", *overrides])
    assert code in (0, 2, 3), (overrides, "".join(said))
