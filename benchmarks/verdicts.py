"""What was asked, what was measured, and whether the one meets the other."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """One line of the summary."""

    quantity: str
    asked: str
    measured: float
    met: bool


def at_least(quantity: str, asked: float, measured: float) -> Verdict:
    """Return the verdict on a number that must not be smaller."""
    return Verdict(quantity, f"≥ {number(asked)}", measured, measured >= asked)


def at_most(quantity: str, asked: float, measured: float) -> Verdict:
    """Return the verdict on a number that must not be larger."""
    return Verdict(quantity, f"≤ {number(asked)}", measured, measured <= asked)


def number(value: float) -> str:
    """Return a number with three digits, in thousands with thin spaces, or as a power of ten where it is small."""
    if value != value:
        return ""
    if float(value).is_integer() and abs(value) < 100.0:
        return f"{value:g}"
    if abs(value) < 1e-2:
        return f"{value:.1e}"
    return f"{value:,.0f}".replace(",", " ") if abs(value) >= 100.0 else f"{value:.3g}"
