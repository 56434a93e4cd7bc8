"""Kernels compile where nothing can be written, too."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import types
from numba.core import caching

from fracctl.compiling import ACCELERATION, compiled, forget_outdated, pointer_with


def test_without_a_writable_directory_kernels_are_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(caching.CompileResultCacheImpl, "_locator_classes", [])

    @compiled
    def total(values: np.ndarray) -> float:
        result: float = values.sum()
        return result

    assert total(np.array([1.0, 2.0])) == 3.0


@pytest.mark.parametrize("writable", [True, False])
def test_functions_of_one_signature_can_be_handed_over(writable: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if not writable:
        monkeypatch.setattr(caching.CompileResultCacheImpl, "_locator_classes", [])

    @pointer_with(ACCELERATION)
    def falling(t: float, q: np.ndarray, v: np.ndarray, u: np.ndarray, p: np.ndarray, out: np.ndarray) -> None:
        out[:] = u - p[0] * q / t

    @pointer_with(types.f8(types.FunctionType(ACCELERATION), types.f8[::1]))
    def first(function: object, q: np.ndarray) -> float:
        out = np.empty(3)
        function(2.0, q, q, q, q, out)
        return float(out[0])

    assert first(falling, np.array([3.0, 1.0, 2.0])) == 3.0 - 3.0 * 3.0 / 2.0


def test_the_package_works_where_no_kernel_can_be_stored() -> None:
    """In a process of its own, where every kernel is compiled without a directory for it."""
    code = """
from numba.core import caching
caching.CompileResultCacheImpl._locator_classes = []
import fracctl.characteristic, fracctl.measures, fracctl.solvers.contour.solver, fracctl.solvers.volterra.solver
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60.0)


@pytest.mark.parametrize(
    ("changed", "kept"), [(None, True), ("callee.py", False), ("other.py", True), ("helpers.py", False)]
)
def test_machine_code_is_forgotten_once_a_kernel_has_changed(tmp_path: Path, changed: str | None, kept: bool) -> None:
    sources = [tmp_path / name for name in ("caller.py", "callee.py", "other.py", "helpers.py")]
    (tmp_path / "__pycache__").mkdir()
    stored = [tmp_path / "__pycache__" / f"{name}.kernel-1.py311.nbi" for name in ("caller", "callee")]
    for age, paths in ((20.0, sources), (10.0, stored)):
        for path in paths:
            path.write_text("from fracctl.compiling import helper" if path.name == "helpers.py" else "")
            os.utime(path, (path.stat().st_mtime - age,) * 2)
    if changed:
        (tmp_path / changed).touch()
    forget_outdated(tmp_path)
    assert [path.exists() for path in stored] == [kept, kept]
