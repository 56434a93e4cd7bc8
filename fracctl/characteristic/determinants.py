"""Compiled determinants of small complex matrices: what is eliminated at many nodes together, and one by one.

At nodes, matrices are given entry by entry, real before imaginary parts, (2 size², nodes).
"""

from __future__ import annotations

from fracctl.arrays import Complexes, Floats
from fracctl.compiling import helper


@helper
def eliminate(entries: Floats, count: int, size: int, gone: int | None) -> None:
    """Eliminate the last coordinates, which hold no other of them; the first row is multiplied by their diagonal.

    With None there are none, and nothing is compiled.
    """
    if gone is not None:
        kept = size - gone
        for k in range(kept, size):
            for j in range(kept):
                _divide(entries, count, 2 * (k * size + j), 2 * (k * size + k))
                for i in range(kept):
                    _subtract(entries, count, 2 * (i * size + j), 2 * (i * size + k), 2 * (k * size + j))
        for k in range(kept, size):
            for j in range(kept):
                _multiply(entries, count, 2 * j, 2 * (k * size + k))


@helper
def _divide(entries: Floats, count: int, a: int, b: int) -> None:
    """Divide entry a by entry b."""
    for n in range(count):
        x, y, u, v = entries[a, n], entries[a + 1, n], entries[b, n], entries[b + 1, n]
        scale = 1.0 / (u * u + v * v)
        entries[a, n], entries[a + 1, n] = (x * u + y * v) * scale, (y * u - x * v) * scale


@helper
def _multiply(entries: Floats, count: int, a: int, b: int) -> None:
    """Multiply entry a by entry b."""
    for n in range(count):
        x, y, u, v = entries[a, n], entries[a + 1, n], entries[b, n], entries[b + 1, n]
        entries[a, n], entries[a + 1, n] = x * u - y * v, x * v + y * u


@helper
def _subtract(entries: Floats, count: int, to: int, a: int, b: int) -> None:
    """Subtract the product of entries a and b."""
    for n in range(count):
        x, y, u, v = entries[a, n], entries[a + 1, n], entries[b, n], entries[b + 1, n]
        entries[to, n] -= x * u - y * v
        entries[to + 1, n] -= x * v + y * u


@helper
def determinant(matrix: Complexes) -> complex:
    """Determinant of a matrix, by elimination in place."""
    value, size = 1.0 + 0.0j, len(matrix)
    for k in range(size):
        pivot = k
        for j in range(k + 1, size):
            if abs(matrix[j, k]) > abs(matrix[pivot, k]):
                pivot = j
        if pivot != k:
            value = -value
            for m in range(k, size):
                matrix[k, m], matrix[pivot, m] = matrix[pivot, m], matrix[k, m]
        value *= matrix[k, k]
        if matrix[k, k] == 0.0:
            break
        for j in range(k + 1, size):
            share = matrix[j, k] / matrix[k, k]
            for m in range(k + 1, size):
                matrix[j, m] -= share * matrix[k, m]
    return value
