"""Magnitude and phase of the loop gain against frequency, with the margins."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from fracctl.figures import labels
from fracctl.figures.loop_gain import COLOURS, LoopGain, loop_gains, table_of
from fracctl.figures.results import FigureError, Results, Selection
from fracctl.figures.style import FULL_WIDTH_IN, GREY

_HEIGHT_IN = 4.4
_LOWEST, _HIGHEST = 1e-3, 1e3
_STRAIGHT = 180.0


def build(results: Results, selection: Selection) -> tuple[Figure, pd.DataFrame]:
    """Draw |L(iω)| above the phase of L(iω), for each initial condition; optimum and baseline.

    A dot marks where |L| = 1 at the least phase margin, a line in the phase leads from there to ±180°; a line in the
    magnitude is the gain margin, if there is one. Frequencies are in units of the orbital rate, and in mHz where the
    plant has scales.

    Raises:
        FigureError: the plant has several controls, or the run holds no frequency responses.
    """
    if len(results.components) > 1:
        raise FigureError("a Bode plot is for one control; take nyquist")
    gains = {name: loop_gains(results, selection, name) for name in selection.initial_conditions}
    figure = Figure(figsize=(FULL_WIDTH_IN, _HEIGHT_IN), layout="constrained")
    axes = figure.subplots(2, len(gains), squeeze=False, sharex=True, sharey="row")
    for place, (name, several) in enumerate(gains.items()):
        above, below = axes[:, place]
        for gain in several:
            above.loglog(gain.omega, np.abs(gain.values), color=COLOURS[gain.kind], label=gain.label)
            below.semilogx(gain.omega, _unbroken(gain), color=COLOURS[gain.kind])
            _margins(above, below, gain)
        above.axhline(1.0, color=GREY, linewidth=0.5, zorder=0)
        below.axhline(-_STRAIGHT, color=GREY, linewidth=0.5, zorder=0)
        above.text(0.985, 0.95, labels.initial_condition(name), transform=above.transAxes, va="top", ha="right")
        above.legend(loc="lower left", fontsize=7.0, borderaxespad=0.3)
        below.set_xlabel(r"Frequency $\omega$ (in units of $n$)" if results.scales else r"Frequency $\omega$")
        if results.scales is not None:
            _in_hertz(above, results.scales.time_s)
    _frame(axes[0, 0], axes[1, 0], [gain for several in gains.values() for gain in several])
    return figure, table_of(gains)


def _frame(above: Axes, below: Axes, gains: list[LoopGain]) -> None:
    sizes = np.concatenate([np.abs(gain.values) for gain in gains])
    above.set_ylim(max(_LOWEST, 0.7 * float(sizes.min())), min(_HIGHEST, 1.4 * float(sizes.max())))
    above.set_xlim(gains[0].omega[0], gains[0].omega[-1])
    above.set_ylabel(r"$|L(\mathrm{i}\omega)|$")
    below.set_ylabel(r"$\arg L(\mathrm{i}\omega)$ (°)")
    highest = max(float(np.degrees(np.angle(gain.values)).max()) for gain in gains)
    below.set_ylim(-1.1 * _STRAIGHT, max(0.55 * _STRAIGHT, highest + 15.0))
    below.yaxis.set_major_locator(MultipleLocator(45.0))


def _unbroken(gain: LoopGain) -> np.ndarray:
    """Return the phase in degrees, NaN where it leaps from -180 to 180."""
    phase = np.degrees(np.angle(gain.values))
    leaps = np.abs(np.diff(phase, prepend=phase[0])) > 1.5 * _STRAIGHT
    return np.where(leaps, np.nan, phase)


def _margins(above: Axes, below: Axes, gain: LoopGain) -> None:
    colour = COLOURS[gain.kind]
    if (found := gain.phase_margin) is not None:
        omega, phase = found
        margin = _STRAIGHT - abs(phase)
        above.plot(omega, 1.0, marker="o", color=colour, markersize=3.5)
        below.plot(omega, phase, marker="o", color=colour, markersize=3.5)
        below.plot([omega, omega], [phase, math.copysign(_STRAIGHT, phase)], color=colour, linewidth=0.8)
        _note(below, f"{margin:.1f}°", omega, math.copysign(_STRAIGHT - 0.35 * margin, phase), gain)
    if (found := gain.gain_margin) is not None:
        omega, size = found
        above.plot([omega, omega], [size, 1.0], color=colour, linewidth=0.8)
        above.plot(omega, size, marker="s", color=colour, markersize=3.5)
        _note(above, f"${-20.0 * math.log10(size):.1f}$ dB", omega, math.sqrt(size), gain)


def _note(ax: Axes, text: str, omega: float, height: float, gain: LoopGain) -> None:
    side = -1.0 if gain.kind == "overall" else 1.0
    look: dict[str, Any] = {
        "fontsize": 7.0,
        "color": COLOURS[gain.kind],
        "va": "center",
        "ha": "right" if side < 0 else "left",
    }
    ground = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
    ax.annotate(text, (omega, height), (4.0 * side, 0.0), textcoords="offset points", bbox=ground, **look)


def _in_hertz(ax: Axes, time_s: float) -> None:
    millihertz = 1e3 / (math.tau * time_s)

    def up(omega: Any) -> Any:
        return omega * millihertz

    def down(frequency: Any) -> Any:
        return frequency / millihertz

    top = ax.secondary_xaxis("top", functions=(up, down))
    top.set_xlabel("Frequency (mHz)", labelpad=4.0)
    top.tick_params(labelsize=7.0)
