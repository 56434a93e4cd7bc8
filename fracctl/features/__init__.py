"""Crossings, maxima and absolute integrals of functions on panels, exact on the interpolant, for whole batches.

The nodes tell in which interval a feature lies, since a polynomial turns next to a node from which its slope points
to a neighbour that is no further out; safeguarded iterations find it. Largest and smallest value of a panel tell
where nothing can lie. The kernels are compiled by numba and kept in its cache on disk: these loops branch on every
member, and as array expressions they cost ten times as much.
"""

from fracctl.features.crossings import last_crossing, value_at
from fracctl.features.integrals import absolute_integral
from fracctl.features.maxima import largest_excursion

__all__ = ["absolute_integral", "largest_excursion", "last_crossing", "value_at"]
