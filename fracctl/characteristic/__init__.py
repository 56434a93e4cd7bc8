"""The characteristic matrix of a linear fractional loop on the cut plane: zeros, their number, bounds on them."""

from fracctl.characteristic.matrix import CharacteristicMatrix
from fracctl.characteristic.poles import principal_poles
from fracctl.characteristic.winding import abscissa_bound, unstable_zeros

__all__ = ["CharacteristicMatrix", "abscissa_bound", "principal_poles", "unstable_zeros"]
