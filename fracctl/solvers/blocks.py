"""Linear equations for node values of several unknowns, block by block, for batches of loops with shared orders."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fracctl.arrays import Floats
from fracctl.characteristic.matrix import CharacteristicMatrix


@dataclass(frozen=True)
class Term:
    """Coefficient times D^order of an unknown, in the equation of another."""

    row: int
    column: int
    order: float
    coefficient: Floats
    """() or (b,)."""


def terms_of(matrix: CharacteristicMatrix) -> Iterator[Term]:
    """Yield the terms of Σ_j A_j D^{β_j} y entry by entry, equal orders merged; the highest ones among them."""
    for i, row in enumerate(matrix.entries):
        for k, entry in enumerate(row):
            if entry is not None:
                for j, exponent in enumerate(entry.exponents):
                    yield Term(i, k, float(exponent + matrix.highest[k]), entry.coefficients[..., j])


def assembled(
    terms: Sequence[Term], unknowns: Sequence[int], batch: int, nodes: int, operator: Callable[[Term], Floats]
) -> Floats:
    """Return the matrix (b, U n, U n) of the terms, each with the `operator` (n, n) of its derivative.

    Args:
        terms: with rows and columns among the unknowns.
        unknowns: their numbers, in the order of the blocks.
        batch: b.
        nodes: n.
        operator: from a term to the matrix of D^order of its column.
    """
    matrix = np.zeros((batch, len(unknowns) * nodes, len(unknowns) * nodes))
    for i, row in enumerate(unknowns):
        for k, column in enumerate(unknowns):
            parts = [term for term in terms if (term.row, term.column) == (row, column)]
            if parts:
                coefficients = np.stack([np.broadcast_to(part.coefficient, batch) for part in parts], axis=-1)
                basis = np.stack([operator(part).ravel() for part in parts])
                where = slice(i * nodes, (i + 1) * nodes), slice(k * nodes, (k + 1) * nodes)
                matrix[:, *where] = (coefficients @ basis).reshape(batch, nodes, nodes)
    return matrix


def solve_each(left: Floats, right: Floats) -> Floats:
    """Solve systems (b, n, n) for right-hand sides (b, n, k); NaN for the singular ones."""
    try:
        return np.asarray(np.linalg.solve(left, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        if len(left) == 1:
            return np.full_like(right, np.nan)
        return np.concatenate([solve_each(left[i : i + 1], right[i : i + 1]) for i in range(len(left))])
