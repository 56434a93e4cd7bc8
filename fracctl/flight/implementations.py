"""Every law as it was designed and as it runs on board, side by side: settling, ΔV, margins, size and noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fracctl.arrays import Array
from fracctl.errors import UnsupportedError
from fracctl.evaluation import LAW_NUMBER
from fracctl.flight.stage_names import CERTAIN, Stage
from fracctl.flight.stages import Sampling
from fracctl.loop import ClosedLoop
from fracctl.sampled import DiscreteController, Navigation, noise_rms, sampled_margins
from fracctl.stability.margins import Margins, margins

IMPLEMENTATIONS = "implementations"
"""Name of the table."""
_ONE = ("phase_margin_deg", "gain_margin_db", "delay_margin_s")
"""Margins of loops with one control."""
_ANY = ("sensitivity_peak", "disk_margin")
_SIZE = ("states", "operations", "noise_position_m", "noise_control_mm_s2")
Record = dict[str, Any]


@dataclass(frozen=True)
class Implementations:
    """What laws become on board, without limits of the thrusters and on the plant of the design.

    A record has the settling times and the ΔV of the flights ``ideal`` and ``sampled``, the margins of either loop, and
    of the sampled one its states and multiply-adds a step, and the rms that the navigation's noise keeps up: of the
    position and of the control, whichever axis has most. What cannot be had is NaN.
    """

    loop: Callable[[Mapping[str, float]], ClosedLoop]
    """The ideal loop of a law by its number, as `fracctl.flight.FlightEvaluation.loop`."""
    sampling: Sampling
    navigation: Navigation

    def records(self, rows: Mapping[str, Array], measures: Sequence[str]) -> Iterator[Record]:
        """Yield a record for each start, law, and the first two stages as far as they were flown.

        Args:
            rows: of a run of one law, or of several by their numbers.
            measures: columns of measures.
        """
        taken = [name for name in measures if name.endswith("_orbits") or name == "delta_v_m_s"]
        heads = [name for name in ("initial_condition", "law") if name in rows]
        numbers = rows.get(LAW_NUMBER, np.zeros(len(rows["stage"])))
        known: dict[tuple[float, str], Record] = {}
        for place in np.flatnonzero(np.isin(rows["stage"], CERTAIN)).tolist():
            number, stage = float(numbers[place]), rows["stage"][place]
            if (number, stage) not in known:
                known[number, stage] = self._of_law(number, stage)
            record: Record = {name: rows[name][place] for name in heads} | {"stage": stage}
            record |= {name: float(rows[name][place]) for name in taken}
            yield record | known[number, stage]

    def _of_law(self, number: float, stage: Stage) -> Record:
        loop = self.loop({LAW_NUMBER: number})
        one = loop.plant.n_controls == 1
        unknown: Record = dict.fromkeys([*(_ONE if one else ()), *_ANY, *_SIZE], math.nan)
        try:
            if stage == "ideal":
                return unknown | _named(margins(loop), one)
            controller = self.sampling.law(loop).discrete(loop.plant.n_controls)
        except UnsupportedError:
            return unknown
        size = {"states": float(controller.n_states), "operations": float(controller.operations)}
        try:
            return unknown | size | _named(sampled_margins(loop.plant, controller), one) | self._noise(loop, controller)
        except UnsupportedError:  # not stable, or too many states
            return unknown | size

    def _noise(self, loop: ClosedLoop, controller: DiscreteController) -> Record:
        if self.navigation.every > 1:  # noise that is held for several periods is not white
            return {}
        scales: Any = loop.plant.scales
        position, velocity = (
            np.max(noise) for noise in (self.navigation.position_noise, self.navigation.velocity_noise)
        )
        kept, control = noise_rms(loop.plant, controller, float(position), float(velocity))
        values = (scales.length_m * kept.max(), 1e3 * scales.acceleration_m_s2 * control.max())
        return dict(zip(_SIZE[2:], map(float, values), strict=True))


def _named(found: Margins, one: bool) -> Record:
    return {name: float(getattr(found, name)) for name in [*(_ONE if one else ()), *_ANY]}
