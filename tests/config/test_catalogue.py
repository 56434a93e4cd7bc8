"""Where the YAML files are found."""

from __future__ import annotations

from pathlib import Path

import pytest

from fracctl.config import catalogue as module
from fracctl.config.catalogue import Catalogue, built_in_directory, catalogue
from fracctl.config.compose import compose
from fracctl.errors import ConfigurationError


def test_in_a_checkout_they_lie_beside_the_package() -> None:
    assert built_in_directory() == Path(__file__).parents[2] / "conf"


def test_in_a_wheel_they_lie_in_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_PACKAGE", tmp_path / "fracctl")
    (tmp_path / "conf").mkdir()
    assert built_in_directory() == tmp_path / "conf"
    (tmp_path / "fracctl" / "conf").mkdir(parents=True)
    assert built_in_directory() == tmp_path / "fracctl" / "conf"


def test_an_earlier_directory_hides_a_later_one(tmp_path: Path) -> None:
    for place in ("first", "second"):
        (tmp_path / place / "plant" / "deep").mkdir(parents=True)
        (tmp_path / place / "plant" / "same.yaml").write_text(f"# fracctl run\n# The {place}\n# one.\ntype: x # no\n")
    (tmp_path / "second" / "plant" / "deep" / "other.yaml").write_text("type: y\n")
    (tmp_path / "first" / "empty").mkdir()
    found = Catalogue((tmp_path / "first", tmp_path / "second"))
    assert found.groups() == ("plant",)
    assert found.options("plant") == ("deep/other", "same")
    assert found.summary("plant", "same") == "The first one."
    assert found.summary("plant", "deep/other") == ""


def test_a_file_in_another_encoding_is_listed(tmp_path: Path) -> None:
    (tmp_path / "plant").mkdir()
    (tmp_path / "plant" / "odd.yaml").write_bytes(b"# \xe9t\xe9\n")
    assert catalogue(tmp_path).summary("plant", "odd")
    with pytest.raises(ConfigurationError, match="decode"):
        compose(["plant=odd"], tmp_path)


def test_a_group_that_the_defaults_do_not_name(tmp_path: Path) -> None:
    (tmp_path / "sensor").mkdir()
    (tmp_path / "sensor" / "one.yaml").write_text("a: 1\n")
    with pytest.raises(ConfigurationError, match=r"the defaults of config\.yaml have no group 'sensor'"):
        compose(["sensor=one"], tmp_path)
