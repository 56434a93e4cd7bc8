"""Runs of the fakes keep their ids while the package's sources are edited."""

from __future__ import annotations

import pytest

from tests.execution.fakes import fix_identity


@pytest.fixture(autouse=True)
def _fixed_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    fix_identity(monkeypatch)
