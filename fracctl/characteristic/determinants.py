"""Compiled determinants of small complex matrices, one by one or at many nodes together."""

from __future__ import annotations

from fracctl.arrays import Complexes, Floats
from fracctl.compiling import compiled


@compiled
def determinants(entries: Floats, count: int, size: int, gone: int, path: Floats) -> None:
    """Determinants of matrices given entry by entry, (2, size², nodes), with the last coordinates eliminated first."""
    re, im = entries
    kept = size - gone
    _eliminate(re, im, count, size, kept)
    if kept == 1:
        for n in range(count):
            path[2, n], path[3, n] = re[0, n], im[0, n]
    elif kept == 2:
        c, d = size, size + 1
        for n in range(count):
            path[2, n] = re[0, n] * re[d, n] - im[0, n] * im[d, n] - re[1, n] * re[c, n] + im[1, n] * im[c, n]
            path[3, n] = re[0, n] * im[d, n] + im[0, n] * re[d, n] - re[1, n] * im[c, n] - im[1, n] * re[c, n]
    else:
        for n in range(count):
            value = determinant((re[:, n] + 1j * im[:, n]).reshape(size, size)[:kept, :kept])
            path[2, n], path[3, n] = value.real, value.imag
    for d in range(kept * size + kept, size * size, size + 1):
        for n in range(count):
            x, y = path[2, n], path[3, n]
            path[2, n], path[3, n] = x * re[d, n] - y * im[d, n], x * im[d, n] + y * re[d, n]


@compiled
def _eliminate(re: Floats, im: Floats, count: int, size: int, kept: int) -> None:
    """Eliminate the coordinates from `kept` on, which hold no other of them."""
    for k in range(kept, size):
        for j in range(kept):
            _divide(re, im, count, k * size + j, k * size + k)
            for i in range(kept):
                _subtract(re, im, count, i * size + j, i * size + k, k * size + j)


@compiled
def _divide(re: Floats, im: Floats, count: int, a: int, b: int) -> None:
    """Divide entry a by entry b."""
    for n in range(count):
        x, y, u, v = re[a, n], im[a, n], re[b, n], im[b, n]
        scale = 1.0 / (u * u + v * v)
        re[a, n], im[a, n] = (x * u + y * v) * scale, (y * u - x * v) * scale


@compiled
def _subtract(re: Floats, im: Floats, count: int, to: int, a: int, b: int) -> None:
    """Subtract the product of entries a and b."""
    for n in range(count):
        x, y, u, v = re[a, n], im[a, n], re[b, n], im[b, n]
        re[to, n] -= x * u - y * v
        im[to, n] -= x * v + y * u


@compiled
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
