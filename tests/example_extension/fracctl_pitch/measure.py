"""An error that counts more the later it is."""

import numpy as np

from fracctl.arrays import Floats
from fracctl.trajectory import Trajectory


class TimeWeightedError:
    """ITAE, the integral of t |x| up to the horizon, summed over the positions; by the trapezoidal rule.

    Args:
        samples: how many.
    """

    name = "time_weighted_error"
    columns = ("time_weighted_error",)

    def __init__(self, samples: int = 4001) -> None:
        self.samples = samples

    def __call__(self, trajectory: Trajectory) -> dict[str, Floats]:
        """Return the column, a number for each trajectory of the batch; infinite where there is none."""
        times = np.linspace(0.0, trajectory.horizon, self.samples)
        positions = trajectory.grid.evaluate(trajectory.positions, times)  # (b, m, t)
        errors = np.trapezoid(times * np.abs(positions), times, axis=-1).sum(axis=1)
        return {self.name: np.where(trajectory.missing, np.inf, errors)}
