"""What thrusters spend: ΔV of all components together, that of an orbit at the end, their peak, and propellant."""

from __future__ import annotations

import numpy as np

from fracctl.arrays import Floats
from fracctl.errors import ArgumentError
from fracctl.fractional.barycentric import interpolation
from fracctl.measures.control_effort import ControlEffort
from fracctl.measures.in_units import TURN, InUnits, last_orbit
from fracctl.measures.peak_acceleration import PeakAcceleration
from fracctl.panels import PanelGrid
from fracctl.trajectory import Trajectory
from fracctl.units import STANDARD_GRAVITY_M_S2, Spacecraft

_MILLI = 1e3
_PIECES = 4
"""Parts between two nodes, each with Gauss's rule of five points."""


class DeltaV(InUnits):
    """ΔV in m/s up to the horizon, in- and out-of-plane together.

    ``delta_v_m_s`` is Σ_i ∫ |υ_i| ds, for thrusters along the axes, the control effort of the paper times the unit of
    speed; ``delta_v_3d_m_s`` is ∫ |υ| ds, for one engine that is turned. With one component they are the same.
    """

    name = "delta_v"
    columns = ("delta_v_m_s", "delta_v_3d_m_s")

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the columns, (b,) each."""
        speed = self.scales.speed_m_s
        by_axis = ControlEffort()(trajectory)[ControlEffort.name]
        together = by_axis if trajectory.controls_at_nodes.shape[1] == 1 else magnitude_integral(trajectory)
        return {"delta_v_m_s": speed * by_axis, "delta_v_3d_m_s": speed * together}


def magnitude_integral(trajectory: Trajectory) -> Floats:
    """Return ∫ |υ| ds over the horizon, (b,); +inf where there is no trajectory.

    By Gauss's rule between the nodes. |υ| has a corner only where all components vanish at once.
    """
    grid, controls = trajectory.grid, trajectory.controls_at_nodes
    first = np.linalg.norm(controls[:, :, 0], axis=1) * grid.panels[0].start
    total = first + sum(_on_panel(grid, controls, i) for i in range(len(grid.panels)))
    return np.where(trajectory.missing, np.inf, total)


def _on_panel(grid: PanelGrid, controls: Floats, place: int) -> Floats:
    where, panel, rule = list(grid.slices())[place]
    points, weights = np.polynomial.legendre.leggauss(5)
    edges = np.unique((rule.y[:-1, None] + np.diff(rule.y)[:, None] * np.linspace(0.0, 1.0, _PIECES + 1)).ravel())
    half = 0.5 * np.diff(edges)
    y = (0.5 * (edges[:-1] + edges[1:])[:, None] + half[:, None] * points).ravel()
    values = controls[:, :, where] @ interpolation(rule.y, rule.weights, y).T
    integral: Floats = np.linalg.norm(values, axis=1) @ ((half[:, None] * weights).ravel() * panel.rate(y))
    return integral


class StationKeeping(InUnits):
    """ΔV of the last orbit before the horizon, in mm/s, for thrusters along the axes: Σ_i ∫ |υ_i| over 2π.

    Of a whole run that is shorter the share of an orbit counts. By Gauss's rule on 400 intervals; a change of sign in
    one of them errs by some 1e-5.
    """

    name = "station_keeping"
    columns = ("station_keeping_mm_s_per_orbit",)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the column, (b,)."""
        grid = trajectory.grid
        times, weights = last_orbit(grid.horizon)
        spent = np.abs(grid.evaluate(trajectory.controls_at_nodes, times)).sum(axis=1) @ weights
        per_orbit = spent * TURN / weights.sum()
        return {self.columns[0]: np.where(trajectory.missing, np.inf, _MILLI * self.scales.speed_m_s * per_orbit)}


class PeakThrust(InUnits):
    """The largest acceleration of one axis, in mm/s²; see `PeakAcceleration`."""

    name = "peak_thrust"
    columns = ("peak_acceleration_mm_s2",)

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the column, (b,)."""
        peak = PeakAcceleration()(trajectory)[PeakAcceleration.name]
        return {self.columns[0]: _MILLI * self.scales.acceleration_m_s2 * peak}


class PeakForce(InUnits):
    """The largest force of one axis, in newtons: the mass of `spacecraft` times the acceleration of `PeakThrust`."""

    name = "peak_force"
    columns = ("peak_force_n",)

    def check(self) -> None:
        """Raise ArgumentError unless everything is known."""
        super().check()
        if self.spacecraft.mass_kg is None:
            raise ArgumentError("spacecraft.mass_kg", None, "must be given for this measure")

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the column, (b,)."""
        peak = PeakAcceleration()(trajectory)[PeakAcceleration.name] * self.scales.acceleration_m_s2
        return {self.columns[0]: force_n(self.spacecraft, peak)}


def force_n(craft: Spacecraft, acceleration_m_s2: Floats) -> Floats:
    """Return the force that accelerates the spacecraft, in newtons."""
    assert craft.mass_kg is not None
    return craft.mass_kg * acceleration_m_s2


class Propellant(InUnits):
    """Propellant in kg for the ΔV of thrusters along the axes, m (1 - exp(-ΔV/(g₀ I_sp))).

    Mass and specific impulse are those of `spacecraft`.
    """

    name = "propellant"
    columns = ("propellant_kg",)

    def check(self) -> None:
        """Raise ArgumentError unless everything is known."""
        super().check()
        for name in ("mass_kg", "isp_s"):
            if getattr(self.spacecraft, name) is None:
                raise ArgumentError(f"spacecraft.{name}", None, "must be given for this measure")

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the column, (b,)."""
        spent = ControlEffort()(trajectory)[ControlEffort.name] * self.scales.speed_m_s
        return {self.columns[0]: propellant_kg(self.spacecraft, spent)}


def propellant_kg(craft: Spacecraft, delta_v_m_s: Floats) -> Floats:
    """Return m (1 - exp(-ΔV/(g₀ I_sp))) for ΔV (b,), (b,)."""
    assert craft.mass_kg is not None
    assert craft.isp_s is not None
    return np.asarray(-craft.mass_kg * np.expm1(-delta_v_m_s / (STANDARD_GRAVITY_M_S2 * craft.isp_s)))
