"""The compiled engine of the contour solver: responses of blocks of members on the grid of a plan.

Block by block the power series fills the first panel and, window by window, the transforms are filled, multiplied by
the kernels and combined to controls; all that a block needs in between stays in the cache. On a panel or window a
derivative has rows: its values at the grid nodes, the last Chebyshev coefficients of the panels, and, on the first
panel, its value at 0+.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fracctl.arrays import Array, Booleans, Floats
from fracctl.compiling import compiled, inlined
from fracctl.solvers.contour.fill import Matrix, fill
from fracctl.solvers.contour.lanes import LANES, larger
from fracctl.solvers.contour.rows import (
    add_shapes,
    combine,
    enlarge,
    enlarge_by_gaps,
    product,
    times_powers,
    transpose,
)


class Start(NamedTuple):
    """The power series on the first panel."""

    numbers: Array
    """First grid node of the panel, number of grid nodes, and end of the last coefficients among the rows, (3,)."""
    steps: Array
    """Steps of the recursion, see `fracctl.fractional.series.Recipe`."""
    omitted: Floats
    """1 / Γ(e + 1) of the omitted powers, which are the last ones."""
    matrix: Floats
    """From coefficients of the other powers to rows of each derivative, (1, w, r, E), or (blocks, w, r, E, LANES)."""


class Windows(NamedTuple):
    """What is computed on each window, whoever the members are."""

    numbers: Array
    """Of each window: first node and end of its nodes on the path, N, first grid node, number of grid nodes, and of
    rows; (windows, 6)."""
    checked: Array
    """Which grid nodes of a window compare the two rules, (windows, c)."""
    kernels: Floats
    """Real matrices that take Z̃ to rows, and to values at the checked times by the other rule; one after the other."""
    places: Array
    """Where they begin, (requests, windows, 2)."""
    shapes: Floats
    """What an initial value adds to the rows of all windows, (1, w, rows), or (blocks, w, rows, LANES)."""


class Wanted(NamedTuple):
    """Derivatives."""

    components: Array
    """Coordinate of each, (w,)."""
    requests: Array
    """Derivatives that share a transform: coordinate, first, number, and the column of the table with a power of the
    members' own to be multiplied by, or -1; (requests, 4)."""
    stored: Array
    """Which of them are stored, positions first."""
    used: Array
    """Which of them controls are made of, filled up to an even number."""


class Members(NamedTuple):
    """What tells members apart, in blocks of members."""

    table: Floats
    """Powers along the path, (1, P, C, 2), or (blocks, P, C, 2, LANES)."""
    entries: Floats
    """Coefficients of M̃, (blocks, t LANES)."""
    sources: Floats
    """Coefficients of r, (blocks, k, t' LANES)."""
    feeds: Floats
    """Gains of the recursion, (blocks, entries, LANES)."""
    initial: Floats
    """y(0) and y'(0), (blocks, 2, p, k LANES)."""
    growth: Floats
    """Remainder of each derivative over that of the series, (blocks, w, LANES)."""
    added: Floats
    """Coefficients of `shapes`, (blocks, w, k, LANES)."""
    gains: Floats
    """υ_i = Σ_u gains[i, u] values[used[u]], (blocks, m, u, LANES)."""


class Outputs(NamedTuple):
    """What comes out, b members from k starts each."""

    positions: Floats
    """(k, b, m, T)."""
    others: Floats
    """Other derivatives that are stored, (k, b, o, T)."""
    controls: Floats
    """(k, b, m, T)."""
    initial_controls: Floats
    """υ(0+), (k, b, m)."""
    peaks: Floats
    """Largest positions and controls at the grid nodes, (k, b, 2)."""
    errors: Floats
    """Largest last Chebyshev coefficients, differences of rules and remainders of both, (k, b, 2)."""
    enclosed: Booleans
    """Whether all contours have all poles on their left, (b,)."""


class _Place(NamedTuple):
    """Of a block among the members."""

    first: int
    live: int


class _Sizes(NamedTuple):
    """Running results of a block."""

    peaks: Floats
    """Of positions and controls, (2, k LANES)."""
    tails: Floats
    """Largest last coefficients of both, (2, k LANES)."""
    differences: Floats
    """Largest difference of each derivative, (w, k LANES)."""


@compiled
def respond_blocks(
    matrix: Matrix, start: Start, windows: Windows, wanted: Wanted, members: Members, first_block: int, outputs: Outputs
) -> None:
    """Fill in the outputs of some blocks of members."""
    starts, size = len(outputs.controls), len(matrix.coordinates)
    width, count = starts * LANES, len(wanted.components)
    most, nodes = start.matrix.shape[2], 0
    for number in range(len(windows.numbers)):
        most, nodes = max(most, windows.numbers[number, 5]), max(nodes, windows.numbers[number, 2])
    odd_work, even_work = np.empty(size * 2 * nodes * width), np.empty(size * 2 * (nodes + 1) * width)
    values, scratch = np.empty(count * most * width), np.empty((max(most, 2 * nodes + 2), width))
    sizes = _Sizes(np.empty((2, width)), np.empty((2, width)), np.empty((count, width)))
    gaps, enclosed = np.empty((count * windows.checked.shape[1], width)), np.empty(LANES, np.bool_)
    for member in range(0, len(outputs.enclosed), LANES):
        sizes.peaks[:], sizes.tails[:], sizes.differences[:] = 0.0, 0.0, 0.0
        enclosed[:] = True
        block = first_block + member // LANES
        place = _Place(member, min(LANES, len(outputs.enclosed) - member))
        table, shapes = _own(members.table, block), _own(windows.shapes, block)
        gains, done = members.gains[block], 0
        for number in range(-1, len(windows.numbers)):
            first, stop, n, grid, times, rows = windows.numbers[max(number, 0)]
            tails = rows
            if number < 0:
                grid, times, tails = start.numbers
                rows = start.matrix.shape[2]
            derivatives = values[: count * rows * width].reshape(count, rows, width)
            if number < 0:
                _begin(start, members, block, wanted, derivatives, sizes.differences)
            else:
                odd = odd_work[: size * 2 * n * width].reshape(size, 2 * n, width)
                even = even_work[: size * 2 * (n + 1) * width].reshape(size, 2 * (n + 1), width)
                path = table[first:stop]
                fill(matrix, path, n, members.entries[block], members.sources[block], odd, even, enclosed)
                _multiply(windows, number, wanted, path, (odd, even), derivatives, scratch, gaps, sizes.differences)
                for w in range(count):
                    add_shapes(derivatives[w], shapes[w, done : done + rows], members.added[block, w])
                done += rows
            _finish(derivatives, times, tails, grid, wanted, gains, place, scratch, sizes, outputs)
        for n in range(place.live):
            outputs.enclosed[member + n] = enclosed[n]
        _conclude(wanted, gains, place, sizes, outputs)


@inlined
def _own(parts: Floats, block: int) -> Floats:
    """Return what belongs to a block: its own, or the only one there is."""
    own: Floats = parts[min(block, len(parts) - 1)]
    return own


@inlined
def _begin(start: Start, members: Members, block: int, wanted: Wanted, values: Floats, differences: Floats) -> None:
    """Fill in rows of all derivatives on the first panel, (w, r, k LANES), and their remainders (w, k LANES)."""
    matrix = _own(start.matrix, block)
    kept, width = matrix.shape[2], members.initial.shape[3]
    coefficients = np.zeros((members.initial.shape[2], kept + len(start.omitted), width))
    _run(start.steps, members.feeds[block], members.initial[block], coefficients)
    remainder = np.zeros(width)
    for i in range(len(coefficients)):
        for e in range(len(start.omitted)):
            row = coefficients[i, kept + e]
            for n in range(width):
                remainder[n] = larger(remainder[n], start.omitted[e] * abs(row[n]))
    for w in range(len(values)):
        product(matrix[w], coefficients[wanted.components[w], :kept], values[w])
        growth = members.growth[block, w]
        for n in range(width):
            differences[w, n] = remainder[n] * growth[n % LANES]


@inlined
def _run(steps: Array, feeds: Floats, initial: Floats, coefficients: Floats) -> None:
    """Run the recursion on coefficients of powers, (p, E, k LANES), from y(0) and y'(0)."""
    for part in range(2):
        for i in range(len(coefficients)):
            for n in range(coefficients.shape[2]):
                coefficients[i, part, n] = initial[part, i, n]
    for step in range(len(steps)):
        target, source, row, column, entry = steps[step]
        for at in range(0, coefficients.shape[2], LANES):
            for n in range(LANES):
                coefficients[row, target, at + n] -= feeds[entry, n] * coefficients[column, source, at + n]


@inlined
def _multiply(
    windows: Windows,
    number: int,
    wanted: Wanted,
    path: Floats,
    halves: tuple[Floats, Floats],
    values: Floats,
    scratch: Floats,
    gaps: Floats,
    differences: Floats,
) -> None:
    """Take transforms at odd nodes to rows of derivatives, (w, r, k LANES), and compare with even nodes."""
    odd, even = halves
    checked = windows.checked[number]
    _, rows, width = values.shape
    flat = values.reshape(-1, width)
    for request in range(len(wanted.requests)):
        component, first, count, column = wanted.requests[request]
        main, other = odd[component], even[component]
        if column >= 0:
            times_powers(main, path, 1, column, scratch[: len(main)])
            main = scratch[: len(main)]
        at = windows.places[request, number, 0]
        kernel = windows.kernels[at : at + count * rows * len(main)].reshape(count * rows, len(main))
        np.dot(kernel, main, flat[first * rows : (first + count) * rows])
        if column >= 0:
            times_powers(other, path, 0, column, scratch[: len(other)])
            other = scratch[: len(other)]
        at = windows.places[request, number, 1]
        kernel = windows.kernels[at : at + count * len(checked) * len(other)].reshape(count * len(checked), len(other))
        compared = gaps[: len(kernel)]
        np.dot(kernel, other, compared)
        for w in range(count):
            enlarge_by_gaps(differences, first + w, values, checked, compared, w * len(checked))


@inlined
def _finish(
    values: Floats,
    nodes: int,
    tails: int,
    grid: int,
    wanted: Wanted,
    gains: Floats,
    place: _Place,
    scratch: Floats,
    sizes: _Sizes,
    outputs: Outputs,
) -> None:
    """Store positions, others and controls on one panel or window, and take their sizes.

    Args:
        values: rows of each derivative, (w, r, k LANES).
        nodes: number of rows that are values at grid nodes,
        tails: and end of those that are last coefficients.
        grid: the first of these nodes.
        wanted: which derivatives are stored or make controls.
        gains: (m, u, LANES).
        place: of the block among the members.
        scratch: for one control.
        sizes: running results.
        outputs: of all members.
    """
    m, control = len(gains), scratch[: values.shape[1]]
    for i in range(len(wanted.stored)):
        rows = values[wanted.stored[i]]
        if i < m:
            enlarge(sizes.peaks[0], rows[:nodes])
            enlarge(sizes.tails[0], rows[nodes:tails])
            transpose(rows, nodes, grid, place.first, place.live, outputs.positions, i)
        else:
            transpose(rows, nodes, grid, place.first, place.live, outputs.others, i - m)
    for i in range(m):
        combine(values, wanted.used, gains, i, control)
        enlarge(sizes.peaks[1], control[:nodes])
        enlarge(sizes.tails[1], control[nodes:tails])
        transpose(control, nodes, grid, place.first, place.live, outputs.controls, i)
        for extra in range(tails, len(control)):
            for k in range(len(outputs.controls)):
                for n in range(place.live):
                    outputs.initial_controls[k, place.first + n, i] = control[extra, k * LANES + n]


@inlined
def _conclude(wanted: Wanted, gains: Floats, place: _Place, sizes: _Sizes, outputs: Outputs) -> None:
    """Write peaks and errors of a block."""
    m = len(gains)
    for at in range(0, sizes.peaks.shape[1], LANES):
        k = at // LANES
        for n in range(place.live):
            member = place.first + n
            position, control = sizes.tails[0, at + n], sizes.tails[1, at + n]
            for i in range(m):
                position = larger(position, sizes.differences[wanted.stored[i], at + n])
                total = 0.0
                for u in range(len(wanted.used)):
                    total += abs(gains[i, u, n]) * sizes.differences[wanted.used[u], at + n]
                control = larger(control, total)
            outputs.errors[k, member, 0], outputs.errors[k, member, 1] = position, control
            for i in range(2):
                outputs.peaks[k, member, i] = sizes.peaks[i, at + n]
