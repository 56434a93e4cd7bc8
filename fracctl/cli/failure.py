"""Errors as a user sees them: a sentence on standard error and an exit code."""

from __future__ import annotations

import traceback

from fracctl.cli import output
from fracctl.errors import FracctlError


def report(error: Exception, debug: bool, label: str = "") -> int:
    """Write an error to standard error, with its traceback if asked, and return the exit code that belongs to it."""
    if debug:
        output.remark("".join(traceback.format_exception(error)).rstrip())
    for line in sentence(error).splitlines():
        output.remark(f"error: {label}{line}")
    return error.exit_code if isinstance(error, FracctlError) else 1


def sentence(error: Exception) -> str:
    """What went wrong; one line for each thing that did."""
    if isinstance(error, FracctlError):
        return str(error)
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror}: '{error.filename}'" if error.filename else error.strerror
    return f"{type(error).__name__}: {error} (a fault of fracctl; --debug shows where)"
