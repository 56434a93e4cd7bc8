"""Kernels compile where nothing can be written, too."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numba.core import caching

from fracctl.compiling import compiled


def test_without_a_writable_directory_kernels_are_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(caching.CompileResultCacheImpl, "_locator_classes", [])

    @compiled
    def total(values: np.ndarray) -> float:
        result: float = values.sum()
        return result

    assert total(np.array([1.0, 2.0])) == 3.0


def test_the_package_works_where_no_kernel_can_be_stored() -> None:
    """In a process of its own, where every kernel is compiled without a directory for it."""
    code = """
from numba.core import caching
caching.CompileResultCacheImpl._locator_classes = []
import fracctl.characteristic, fracctl.measures, fracctl.solvers.contour, fracctl.solvers.volterra
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60.0)
