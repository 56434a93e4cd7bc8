"""The comparison as an evaluation: what its rows say in the end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from fracctl.arrays import Array, Floats
from fracctl.comparison.compared import ComparedLaws
from fracctl.comparison.conclusion import conclude
from fracctl.errors import UnsupportedError
from fracctl.evaluation import Conclusion


@dataclass(frozen=True)
class ComparisonEvaluation(ComparedLaws):
    """Several laws on the same problems; rows come from the searches of `fracctl.comparison.Comparison` only.

    Raises:
        ArgumentError: as `fracctl.comparison.compared.ComparedLaws`.
    """

    def conclude(self, parts: Iterable[Mapping[str, Array]]) -> Conclusion:
        """Return the table of the comparison, what it says, and its best points."""
        return conclude(self, parts)

    def __call__(self, design: Mapping[str, Floats]) -> dict[str, Array]:  # noqa: ARG002 - refused whatever it is
        """Refuse: points without a law and a problem have no row.

        Raises:
            UnsupportedError: always.
        """
        raise UnsupportedError("evaluation: comparison goes with survey: comparison only")
