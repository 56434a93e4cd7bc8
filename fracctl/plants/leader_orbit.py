"""The orbit of a leader under J2 and drag, as it is needed in the frame that goes with it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fracctl.arrays import Array, Floats
from fracctl.compiling import compiled_with
from fracctl.errors import UnsupportedError

STATES = 6
_NODES = 14
"""Values of a Chebyshev polynomial on each piece."""
_FEWEST_PIECES = 16
"""Of 2π."""
_REACH = 4.6
"""Half a piece to the singularity of a Kepler orbit nearest to perigee: the polynomials then err by 1e-14."""
_TURN = 2.0 * math.pi


class LeaderOrbit:
    """Radius, rates and the pole's direction of a leader, functions of time from 0 on.

        y = [r, r', h, p],    r'' = h²/r³ - 1/r² + a_r,    h' = r a_t,    p' = -ω × p,    ω = [r a_n/h, 0, h/r²]

    with the polar axis p of the planet in the leader's frame (radial, along-track, normal), a = n = GM = 1, and

        a = -3k/(2r⁴) [1 - 3p_x², 2 p_x p_y, 2 p_x p_z] - d e^{(1 - r)/η} |v| v,        v = [r', h/r, 0]

    It is integrated (DOP853, to 1e-13) as far as somebody asks, turn by turn, and kept as Chebyshev polynomials.

    Args:
        eccentricity: e of the osculating orbit at time 0.
        inclination: i in radians.
        argument: argument of latitude at time 0 in radians.
        oblateness: k = J2 (R/a)².
        drag: d = ½ ρ C_D A/m a, with the density at r = a.
        scale_height: η of the density, over a.
        anomaly: true anomaly at time 0 in radians.
    """

    def __init__(
        self,
        eccentricity: float,
        inclination: float,
        argument: float,
        oblateness: float,
        drag: float,
        scale_height: float,
        anomaly: float = 0.0,
    ) -> None:
        e, s = eccentricity, math.sin(inclination)
        pole = [s * math.sin(argument), s * math.cos(argument), math.cos(inclination)]
        momentum = math.sqrt(1.0 - e * e)
        r, climb = (1.0 - e * e) / (1.0 + e * math.cos(anomaly)), e * math.sin(anomaly) / momentum
        self._end = np.array([r, climb, momentum, *pole])
        self._constants = np.array([oblateness, drag, scale_height])
        distance = math.acosh(1.0 / e) - math.sqrt(1.0 - e * e) if e > 0.0 else math.inf
        self._pieces = max(_FEWEST_PIECES, math.ceil(0.5 * _TURN * _REACH / distance))
        k = np.arange(_NODES)
        angles = np.pi * (1.0 - (k + 0.5) / _NODES)
        self._fit = np.linalg.inv(np.cos(angles[:, None] * k))
        places = np.arange(self._pieces)[:, None] + 0.5 + 0.5 * np.cos(angles)
        self._places = np.append(places.ravel() / self._pieces * _TURN, _TURN)
        self._turns: list[Floats] = []
        self._table: Floats = np.empty((0, _NODES, STATES))

    def __call__(self, t: Floats) -> Floats:
        """Return y at times (b,) from 0 on, (b, 6)."""
        times = np.ascontiguousarray(t)
        self.until(times.max(initial=0.0))
        out = np.empty((len(times), STATES))
        _evaluate(self._table, self._pieces / _TURN, times, out)
        return out

    def until(self, time: float) -> tuple[Floats, float]:
        """Return the coefficients of the pieces from 0 to beyond a time, (pieces, nodes, 6), and pieces in 1/n."""
        while len(self._turns) * _TURN <= time:
            self._turn()
        return self._table, self._pieces / _TURN

    def nodal_period(self) -> float:
        """Return the time between the first two passages of the ascending node from time 0 on.

        Raises:
            UnsupportedError: the orbit is equatorial and has none.
        """
        times = np.linspace(0.0, 3.0 * _TURN, 1000)
        y = self(times)
        if np.hypot(y[0, 3], y[0, 4]) < 1e-9:
            raise UnsupportedError("an equatorial orbit has no node and no nodal period; give the delay")
        angle = np.unwrap(np.arctan2(y[:, 3], y[:, 4]))
        first = math.ceil(angle[0] / _TURN - 1e-12)
        passages = []
        for whole in (first, first + 1):
            place = int(np.searchsorted(angle, whole * _TURN - 1e-12))
            low, high = times[max(place - 1, 0)], times[place + 1]
            passages.append(
                0.0 if abs(angle[0] - whole * _TURN) < 1e-12 else brentq(self._height, low, high, xtol=1e-14)
            )
        return passages[1] - passages[0]

    def _height(self, t: float) -> float:
        return float(self(np.array([t]))[0, 3])

    def _turn(self) -> None:
        """Integrate one more turn."""
        run = solve_ivp(
            lambda _, y: _leader_rates(y, self._constants),
            (0.0, _TURN),
            self._end,
            "DOP853",
            self._places,
            rtol=1e-13,
            atol=1e-15,
        )
        self._end = run.y[:, -1]
        values = run.y.T[:-1].reshape(self._pieces, _NODES, STATES)
        self._turns.append(np.einsum("kq,pqn->pkn", self._fit, values))
        self._table = np.ascontiguousarray(np.concatenate(self._turns))


class LeaderOrbits:
    """The orbits of b leaders, one a member; or of one that all members share.

    Args:
        orbits: of the leaders.
    """

    def __init__(self, orbits: Sequence[LeaderOrbit]) -> None:
        self._orbits, self._known = tuple(orbits), -1.0
        self._tables, self._densities = np.empty((0, 0, _NODES, STATES)), np.empty(0)

    def take(self, rows: Array) -> LeaderOrbits:
        """Return those of some members."""
        return self if len(self._orbits) == 1 else LeaderOrbits([self._orbits[row] for row in rows])

    def __call__(self, t: Floats) -> Floats:
        """Return y of each member at its time, (b,) from 0 on, (b, 6)."""
        if len(self._orbits) == 1:
            return self._orbits[0](t)
        times = np.ascontiguousarray(t)
        if (last := float(times.max(initial=0.0))) > self._known:
            self._gather(last)
        out = np.empty((len(times), STATES))
        _evaluate_each(self._tables, self._densities, times, out)
        return out

    def _gather(self, last: float) -> None:
        found = [orbit.until(last) for orbit in self._orbits]
        longest = max(len(table) for table, _ in found)
        self._tables = np.zeros((len(found), longest, _NODES, STATES))
        for place, (table, _) in enumerate(found):
            self._tables[place, : len(table)] = table
        self._densities = np.array([density for _, density in found])
        self._known = float(min(len(table) / density for table, density in found)) * (1.0 - 1e-12)


@lru_cache(maxsize=2048)
def leader_orbit(*numbers: float) -> LeaderOrbit:
    """Return the orbit of `LeaderOrbit`'s arguments, integrated once for all laws that fly about it."""
    return LeaderOrbit(*numbers)


@compiled_with(error_model="numpy")
def _evaluate_each(tables: Floats, densities: Floats, times: Floats, out: Floats) -> None:
    """Write y at the times, of member i from its own pieces."""
    for i in range(len(times)):
        _evaluate(tables[i], densities[i], times[i : i + 1], out[i : i + 1])


@compiled_with(error_model="numpy")
def _evaluate(table: Floats, density: float, times: Floats, out: Floats) -> None:
    for i in range(len(times)):
        place = times[i] * density
        piece = min(max(int(place), 0), len(table) - 1)
        x = 2.0 * (place - piece) - 1.0
        for n in range(out.shape[1]):
            one, two = 0.0, 0.0
            for k in range(table.shape[1] - 1, 0, -1):
                one, two = 2.0 * x * one - two + table[piece, k, n], one
            out[i, n] = x * one - two + table[piece, 0, n]


@compiled_with(error_model="numpy")
def _leader_rates(y: Floats, constants: Floats) -> Floats:
    r, climb, h, px, py, pz = y
    oblate = 3.0 * constants[0] / r**4
    speed = math.sqrt(climb * climb + h * h / (r * r))
    drag = constants[1] * math.exp((1.0 - r) / constants[2]) * speed
    turn, roll = h / (r * r), -oblate * px * pz * r / h
    out = np.empty(6)
    out[0] = climb
    out[1] = h * h / r**3 - 1.0 / (r * r) - 0.5 * oblate * (1.0 - 3.0 * px * px) - drag * climb
    out[2] = r * (-oblate * px * py - drag * h / r)
    out[3] = turn * py
    out[4] = roll * pz - turn * px
    out[5] = -roll * py
    return out
