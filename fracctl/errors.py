"""Everything fracctl refuses, in one form: what was given, what is allowed, what to use instead."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class FracctlError(Exception):
    """Base of all errors a user can cause; `exit_code` is what the command line returns for it."""

    exit_code = 1


class RunError(FracctlError):
    """A run could not be finished (exit code 1)."""


class IncompleteRunWarning(UserWarning):
    """The result of a run lacks points, or a check of it failed."""


class UsageError(FracctlError):
    """The command line was misused (exit code 2)."""

    exit_code = 2


class ConfigurationError(FracctlError):
    """A configuration is invalid (exit code 3)."""

    exit_code = 3


class ArgumentError(FracctlError, ValueError):
    """An argument of a library call is out of its range or has the wrong shape."""

    exit_code = 3

    def __init__(self, name: str, value: object, allowed: str, instead: str | None = None) -> None:
        self.name, self.value, self.allowed, self.instead = name, value, allowed, instead
        cure = f"; {instead}" if instead else ""
        super().__init__(f"Argument `{name}` {allowed}, but is {value}{cure}")


class UnsupportedError(FracctlError, ValueError):
    """A solver was handed a problem outside its class; the sentence names the solver to use."""

    exit_code = 3


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return ``; did you mean 'x'?`` for the nearest known word, or an empty string."""
    matches = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{matches[0]}'?" if matches else ""
