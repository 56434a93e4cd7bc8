"""Batches of design points as the surveys draw them, and their members as loops of the references."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Array
from fracctl.config.build import build_evaluation
from fracctl.config.compose import compose
from fracctl.controllers.parameters import entry_names
from fracctl.evaluation import Evaluation
from fracctl.trajectory import Trajectory
from tests.references import loops
from tests.references.laplace import Reference
from tests.references.loops import Floats, Loop

ORDERS = {"out-of-plane": (0.91,), "in-plane": (0.99, 0.90)}
"""Of the published optima from IC1."""
BEST_GAINS = {
    "out-of-plane": np.array([[0.85, 2.0]]),
    "in-plane": np.array([[4.0, -1.35, 2.4, 0.65], [3.15, 0.4, 0.7, 1.95]]),
}
"""Published with them; the first member of every batch."""
LQR_GAINS = np.array([[4.0, -0.95, 2.4, 0.65], [3.0, 0.3, 0.65, 1.95]])
COMPONENTS = {"out-of-plane": "w", "in-plane": "uv"}
_CONFIGURATION = {
    "out-of-plane": ("plant=hcw_out_of_plane", "controller=pd_alpha", "measures=standard"),
    "in-plane": ("plant=hcw_in_plane", "controller=pd_alpha_in_plane", "measures=in_plane"),
}


@dataclass(frozen=True)
class Case:
    """A batch, from one or more initial conditions."""

    plane: str
    gains: Floats
    """[K_P K_D], (b, m, 2m)."""
    alpha: tuple[float, ...]
    evaluation: Evaluation

    @property
    def size(self) -> int:
        """Number of evaluations: design points times initial conditions."""
        return len(self.gains) * len(self.evaluation.initial_conditions)

    @property
    def design(self) -> dict[str, Floats]:
        """The design points by the names of the law's parameters."""
        components = COMPONENTS[self.plane]
        named = {f"alpha_{c}": np.full(len(self.gains), order) for c, order in zip(components, self.alpha, strict=True)}
        for prefix, block in zip(("k_p", "k_d"), np.split(self.gains, 2, axis=2), strict=True):
            for i, row in enumerate(entry_names(prefix, components)):
                named |= {name: np.ascontiguousarray(block[:, i, j]) for j, name in enumerate(row)}
        return named

    def rows(self) -> Mapping[str, Array]:
        """Evaluate the batch."""
        return self.evaluation(self.design)

    def loop(self, member: int, initial_condition: str = "ic1") -> Loop:
        """Return a member as a loop of the references."""
        start = loops.initial_state(initial_condition, COMPONENTS[self.plane])
        if self.plane == "out-of-plane":
            k_p, k_d = self.gains[member, 0]
            return loops.out_of_plane(k_p, k_d, self.alpha[0], start)
        return loops.in_plane(self.gains[member], self.alpha, start)

    def trajectory(self, member: int, times: Floats) -> tuple[Floats, Floats]:
        """Return positions and controls (t, m) of a member from the first initial condition, as a survey solves it."""
        states = np.stack(list(self.evaluation.initial_conditions.values()))
        solver, loop = self.evaluation.solver, self.evaluation.loop(self.design)
        for part in solver.survey(loop, states, self.evaluation.horizon):
            place = np.flatnonzero(part.rows == member)
            if place.size:
                return values(part.trajectory, int(place[0]), times)
        raise LookupError(f"member {member} is not among the rows")


def case(
    plane: str,
    size: int = 4096,
    *,
    periods: float = 2.0,
    initial_conditions: Sequence[str] = ("ic1",),
    alpha: tuple[float, ...] | None = None,
    gains: Floats | None = None,
) -> Case:
    """Return a batch over `periods` of the chief; gains as the surveys draw them unless given."""
    named = ",".join(initial_conditions)
    overrides = [*_CONFIGURATION[plane], f"initial_condition=[{named}]", f"horizon_periods={periods}"]
    drawn = _drawn(plane, size) if gains is None else gains
    return Case(plane, drawn, alpha or ORDERS[plane], build_evaluation(compose(overrides, None)))


def wide_gains(size: int) -> Floats:
    """Return in-plane gains uniform in [-8, 8], as a global search draws them."""
    return np.random.default_rng(2).uniform(-8.0, 8.0, (size, 2, 4))


def grid_gains() -> Floats:
    """Return the 41 × 41 out-of-plane gains of the published survey."""
    axis = np.round(np.linspace(0.0, 2.0, 41), 2)
    k_p, k_d = np.meshgrid(axis, axis, indexing="ij")
    return np.stack([k_p, k_d], axis=-1).reshape(-1, 1, 2)


def _drawn(plane: str, size: int) -> Floats:
    """Draw out-of-plane gains in [0, 2], in-plane gains within 0.5 of the LQR gains."""
    generator = np.random.default_rng(1)
    if plane == "out-of-plane":
        gains = generator.uniform(0.0, 2.0, (size, 1, 2))
    else:
        gains = LQR_GAINS + generator.uniform(-0.5, 0.5, (size, 2, 4))
    gains[0] = BEST_GAINS[plane]
    return gains


def values(trajectory: Trajectory, member: int, times: Floats) -> tuple[Floats, Floats]:
    """Return positions and controls (t, m) of one member."""
    m = trajectory.positions.shape[1]
    states, controls = trajectory(times), trajectory.control(times)
    return states[member, :, :m], controls[member]


class Truth:
    """References of some loops, to 1e-13 of the peak, each computed once."""

    def __init__(self, members: Sequence[Loop], horizon: float) -> None:
        self.members = members
        self.references = [Reference(member) for member in members]
        dense = np.linspace(1e-6, horizon, 2001)
        self._peaks = [
            tuple(np.abs(part).max() for part in (exact.position, exact.control))
            for exact in (reference(dense) for reference in self.references)
        ]

    def error(self, member: int, times: Floats, positions: Floats, controls: Floats) -> float:
        """Return the largest error of positions and controls, each relative to its peak; inf for what is not finite."""
        exact = self.references[member](times)
        pairs = zip((positions, controls), (exact.position, exact.control), self._peaks[member], strict=True)
        error = max(float(np.max(np.abs(got - wanted)) / peak) for got, wanted, peak in pairs)
        return error if np.isfinite(error) else float("inf")
