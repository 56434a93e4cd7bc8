"""A controller in SI units, for other programs: JSON, NumPy's npz, and C."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fracctl.controllers.linear import LinearLawTerms
from fracctl.errors import RunError, UnsupportedError
from fracctl.plants.state import StatePlant
from fracctl.sampled.c_code import c_source
from fracctl.sampled.controller import DiscreteController
from fracctl.sampled.law import SampledLaw
from fracctl.sampled.tolerance import memory_orders
from fracctl.units import Scales

FORMAT = "fracctl sampled controller 1"


@dataclass(frozen=True)
class ExportedController:
    """A controller that takes positions in m and velocities in m/s and gives accelerations in m/s².

    x_{k+1} = A x_k + B y_k,        u_k = C x_k + D y_k,        x_0 = E y_0,        y = [ξ, ξ']
    """

    controller: DiscreteController
    """The matrices in SI units; the period stays dimensionless there."""
    components: tuple[str, ...]
    """Names of the m positions."""
    period_s: float
    """T_s in seconds."""
    description: str
    """What it implements, in a line."""
    gains: tuple[dict[str, Any], ...]
    """Terms υ = Σ G D^order ξ of the law, each with order, matrix, and unit."""

    def as_json(self) -> dict[str, Any]:
        """Return what `controller.json` holds; A is given by its entries, row, column, value, from 0."""
        c = self.controller
        return {
            "format": FORMAT,
            "description": self.description,
            "equations": "x[k+1] = A x[k] + B y[k]; u[k] = C x[k] + D y[k]; x[0] = E y[0]",
            "components": list(self.components),
            "measurement": [f"{name} [m]" for name in self.components] + [f"{n}_dot [m/s]" for n in self.components],
            "control": [f"{name} [m/s^2]" for name in self.components],
            "period_s": self.period_s,
            "delay_s": self.period_s * c.delay,
            "states": c.n_states,
            "operations": c.operations,
            "law": list(self.gains),
            "A": {name: entries.tolist() for name, entries in self._entries.items()},
            **{name: getattr(c, name.lower()).tolist() for name in "BCDE"},
        }

    def write(self, folder: Path) -> list[Path]:
        """Write `controller.json`, `controller.npz` and `controller.c` and return their paths.

        Raises:
            RunError: the folder cannot be written to.
        """
        c = self.controller
        text = json.dumps(self.as_json(), indent=1, ensure_ascii=False) + "\n"
        paths = [folder / f"controller.{suffix}" for suffix in ("json", "npz", "c")]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            paths[0].write_text(text, encoding="utf-8")
            matrices = {name: getattr(c, name.lower()) for name in "BCDE"}
            np.savez_compressed(
                paths[1],
                **{f"A_{name}": entries for name, entries in self._entries.items()},
                **matrices,
                period_s=self.period_s,
                delay_s=self.period_s * c.delay,
                components=np.array(self.components),
            )
            paths[2].write_text(c_source(self.controller, self.period_s, self.components, self._remarks), "utf-8")
        except OSError as error:
            raise RunError(f"cannot write to '{folder}': {error.strerror}") from error
        return paths

    @property
    def _entries(self) -> dict[str, Any]:
        """A by its entries, for a long memory is a matrix of hardly anything but zeros."""
        found = self.controller.a.tocoo()
        return {"rows": found.row, "columns": found.col, "values": found.data}

    @property
    def _remarks(self) -> list[str]:
        lines = [self.description]
        for gain in self.gains:
            values = ", ".join("[" + ", ".join(f"{g:.9g}" for g in row) + "]" for row in gain["matrix"])
            lines.append(f"gains of D^{gain['orders']}: [{values}] {gain['unit']}")
        return lines


def export(plant: StatePlant, law: SampledLaw) -> ExportedController:
    """Return a sampled law's controller in SI units.

    Lengths L, time T and accelerations L/T² of the plant turn A, B, C, D, E into A, B/[1, 1/T], C/T², D/T² [1, T], and
    E [1, T]; states have the unit of length.

    Args:
        plant: with scales.
        law: for it.

    Raises:
        UnsupportedError: the plant has no units, or the law cannot be sampled.
    """
    if plant.scales is None:
        raise UnsupportedError(f"{plant} has no units; a controller is exported for a plant with scales")
    m, time = plant.n_controls, plant.scales.time_s
    made = law.discrete(m)
    columns = np.repeat([1.0, time], m)
    controller = DiscreteController(
        made.a,
        made.b * columns,
        made.c / time**2,
        made.d * columns / time**2,
        made.e * columns,
        made.integral_of,
        made.period,
        made.delay,
    )
    period = made.period * time
    terms = law.law.linear_terms(m)
    memory = f", {law.memory}" if memory_orders(terms) else ""
    description = f"{type(law.law).__name__}{memory}, fed by {law.feed}, every {period:.6g} s"
    gains = si_gains(terms, m, plant.scales)
    names = tuple(name.removesuffix("_dot") for name in plant.state_names[:m])
    return ExportedController(controller, names, period, description, gains)


def si_gains(terms: LinearLawTerms, n_controls: int, scales: Scales) -> tuple[dict[str, Any], ...]:
    """Return the terms υ = Σ G D^γ ξ in SI units; a gain of D^γ has the unit s^(γ-2).

    Filters have terms of their own states z: those stand with ``of`` z, and their time constants in seconds.

    Args:
        terms: of the law.
        n_controls: m.
        scales: of the plant.
    """
    found: list[dict[str, Any]] = []
    for term in terms.control:
        matrix, orders = _first(term.matrix, 2), _first(term.orders, 1)
        own, filtered = matrix[:, :n_controls], matrix[:, n_controls:]
        if own.any():
            exponents = orders[:n_controls]
            unit = " ".join(dict.fromkeys(_unit(order) for order in exponents))
            values = own * scales.time_s ** (exponents - 2.0)
            found.append({"of": "position", "orders": exponents.tolist(), "matrix": values.tolist(), "unit": unit})
        if filtered.any():
            # z' = (ξ' - z)/T_f is a velocity
            lags = [_first(part.matrix, 2)[:, n_controls:] for part in terms.auxiliary]
            rates = -np.diag(sum(lags, np.zeros((filtered.shape[1], filtered.shape[1]))))
            times = [math.inf if rate == 0.0 else scales.time_s / rate for rate in rates.tolist()]
            values = filtered / scales.time_s
            found.append(
                {"of": "filtered velocity", "orders": [1.0] * n_controls, "matrix": values.tolist(), "unit": "s^-1"}
                | {"time_constants_s": times}
            )
    return tuple(found)


def _unit(order: float) -> str:
    return f"s^{order - 2.0:.12g}"


def _first(array: Any, ndim: int) -> Any:
    return array[0] if array.ndim > ndim else array
