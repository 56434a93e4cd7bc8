"""Numbers and counts as a reader meets them."""

from __future__ import annotations

from typing import Any


def number(value: Any, digits: int = 6) -> str:
    """A number for reading; anything else as text."""
    if value is None:
        return "-"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return f"{value:.{digits}g}"


def count(how_many: int, what: str, plural: str = "s") -> str:
    """``1 point``, ``2 points``, ``2 searches``."""
    return f"{how_many} {what}" + ("" if how_many == 1 else plural)
