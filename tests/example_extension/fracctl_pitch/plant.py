"""Small pitch motion of a satellite on a circular orbit."""

from fracctl.errors import ArgumentError
from fracctl.plants import LinearPlant


class GravityGradient(LinearPlant):
    """Pitch under the gravity gradient.

        theta'' = -3 k theta + u,    time in units of 1/n

    Args:
        inertia_ratio: k = (I_roll - I_yaw) / I_pitch; below 0 the attitude is unstable without control.

    Raises:
        ArgumentError: no satellite has such a ratio.
    """

    def __init__(self, inertia_ratio: float = 0.5) -> None:
        if not -1.0 < inertia_ratio < 1.0:
            raise ArgumentError("inertia_ratio", inertia_ratio, "must lie in (-1, 1)")
        super().__init__(stiffness=-3.0 * inertia_ratio, components=("theta",))
