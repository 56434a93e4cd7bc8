"""Run ids: the same for what gives the same numbers, another for what does not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fracctl.store import identity
from fracctl.store.identity import run_id, sources_digest
from fracctl.store.provenance import differences, provenance

CONFIGURATION: dict[str, Any] = {
    "controller": {"alpha_w": 0.91, "k_p_w": 0.85},
    "seed": 0,
    "scheduler": {"type": "serial"},
    "figures": {},
    "output_dir": "outputs",
}


def test_the_order_of_keys_does_not_matter() -> None:
    assert run_id(dict(reversed(CONFIGURATION.items()))) == run_id(CONFIGURATION)


@pytest.mark.parametrize("change", [{"scheduler": {"type": "local"}}, {"figures": {"a": {}}}, {"output_dir": "/x"}])
def test_what_changes_no_number_changes_no_id(change: dict[str, Any]) -> None:
    assert run_id(CONFIGURATION | change) == run_id(CONFIGURATION)


@pytest.mark.parametrize("change", [{"seed": 1}, {"controller": {"alpha_w": 0.92, "k_p_w": 0.85}}, {"horizon": 1.0}])
def test_what_may_change_a_number_changes_the_id(change: dict[str, Any]) -> None:
    assert run_id(CONFIGURATION | change) != run_id(CONFIGURATION)


def test_a_controller_beside_laws_changes_no_id() -> None:
    other = {"controller": {"alpha_w": 0.5}}
    several = CONFIGURATION | {"evaluation": {"laws": {"pd": {"type": "pd"}}}}
    assert run_id(several | other) == run_id(several)
    alone = CONFIGURATION | {"evaluation": {"laws": {}}}
    assert run_id(alone | other) != run_id(alone)


def test_sources_and_versions_change_the_id(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = run_id(CONFIGURATION)
    assert run_id(CONFIGURATION, sources="other") != before
    monkeypatch.setattr(identity, "version", lambda name: "0.0")
    assert run_id(CONFIGURATION) != before


@pytest.mark.parametrize("name", ["numpy", "scipy", "numba", "llvmlite", "pymoo", "moocore"])
def test_the_version_of_every_package_that_computes_changes_the_id(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before, found = run_id(CONFIGURATION), provenance(CONFIGURATION)
    assert differences(found) == []
    known = identity.version
    monkeypatch.setattr(identity, "version", lambda other: "0.0" if other == name else known(other))
    assert run_id(CONFIGURATION) != before
    assert differences(found) == [f"{name} {found['versions'][name]}, now 0.0"]


def test_another_extension_is_told() -> None:
    found = provenance(CONFIGURATION) | {"extensions": {"pitch_package": "0"}}
    assert differences(found) == ["other sources of pitch_package"]


def test_the_digest_sees_names_and_contents(tmp_path: Path) -> None:
    def digest(files: dict[str, str]) -> str:
        for path in tmp_path.rglob("*.py"):
            path.unlink()
        for name, text in files.items():
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_text(text)
        return sources_digest.__wrapped__(tmp_path)

    first = digest({"a.py": "x", "b/c.py": "y"})
    assert digest({"b/c.py": "y", "a.py": "x", "notes.txt": "z"}) == first
    others = [{"a.py": "x", "b/c.py": "z"}, {"a.py": "x", "b/d.py": "y"}, {"a.py": "xb/c.pyy"}]
    assert first not in [digest(files) for files in others]


def test_an_id_is_short() -> None:
    assert len(run_id(CONFIGURATION)) == 12
