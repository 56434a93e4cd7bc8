"""A controller as one file of C99 without dependencies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.sparse import csr_array

from fracctl.arrays import Array
from fracctl.sampled.controller import DiscreteController, Rows

_TEMPLATE = """\
/*
 * Sampled control law, written by fracctl.
 *
@REMARKS@
 *
 *   x[k+1] = A x[k] + B y[k],    u[k] = C x[k] + D y[k],    x[0] = E y[0]
 *
 *   y: @MEASUREMENTS@
 *   u: @CONTROLS@
 *
 * Call fracctl_init once with the first measurement, then fracctl_step every @PERIOD@ s with each measurement, the
 * first one included; its control is held for a period. One copy of the state for each controller. No allocation,
 * no library, @OPERATIONS@ multiply-adds a step (rows that only move a number not counted). ISO C99.
 */

#define FRACCTL_STATES @STATES@
#define FRACCTL_MEASUREMENTS @INPUTS@
#define FRACCTL_CONTROLS @OUTPUTS@

typedef struct {
    double x[@LENGTH@]; /* memory, in m */
} fracctl_controller;

void fracctl_init(fracctl_controller *self, const double y[FRACCTL_MEASUREMENTS]);
void fracctl_step(fracctl_controller *self, const double y[FRACCTL_MEASUREMENTS], double u[FRACCTL_CONTROLS]);

/* [A B; C D] by rows: the entries of row r are those from step_first[r] to step_first[r + 1] - 1 */
@STEP@

/* E by rows */
@INIT@

void fracctl_init(fracctl_controller *self, const double y[FRACCTL_MEASUREMENTS])
{
    int r, j;
    self->x[0] = 0.0;
    for (r = 0; r < FRACCTL_STATES; ++r) {
        double sum = 0.0;
        for (j = init_first[r]; j < init_first[r + 1]; ++j) {
            sum += init_value[j] * y[init_column[j]];
        }
        self->x[r] = sum;
    }
}

void fracctl_step(fracctl_controller *self, const double y[FRACCTL_MEASUREMENTS], double u[FRACCTL_CONTROLS])
{
    double next[@LENGTH@];
    int r, j;
    for (r = 0; r < FRACCTL_STATES + FRACCTL_CONTROLS; ++r) {
        double sum = 0.0;
        for (j = step_first[r]; j < step_first[r + 1]; ++j) {
            const int column = step_column[j];
            sum += step_value[j] * (column < FRACCTL_STATES ? self->x[column] : y[column - FRACCTL_STATES]);
        }
        if (r < FRACCTL_STATES) {
            next[r] = sum;
        } else {
            u[r - FRACCTL_STATES] = sum;
        }
    }
    for (r = 0; r < FRACCTL_STATES; ++r) {
        self->x[r] = next[r];
    }
}
"""


def c_source(controller: DiscreteController, period_s: float, components: Sequence[str], remarks: Sequence[str]) -> str:
    """Return the source text; constants have 17 digits, so they are the same numbers.

    Args:
        controller: in SI units.
        period_s: T_s in seconds, for the comment.
        components: names of the positions, for the comment.
        remarks: further lines of the comment.
    """
    n, m = controller.n_states, controller.n_controls
    measured = [f"{name} [m]" for name in components] + [f"{name}_dot [m/s]" for name in components]
    filled = {
        "REMARKS": "\n".join(f" *   {_harmless(line)}" for line in remarks),
        "MEASUREMENTS": _harmless(", ".join(measured)),
        "CONTROLS": _harmless(", ".join(f"{name} [m/s^2]" for name in components)),
        "PERIOD": f"{period_s:.9g}",
        "OPERATIONS": str(controller.operations),
        "STATES": str(n),
        "INPUTS": str(2 * m),
        "OUTPUTS": str(m),
        "LENGTH": str(max(n, 1)),
        "STEP": _rows("step", controller.rows),
        "INIT": _rows("init", Rows.of(csr_array(controller.e))),
    }
    text = _TEMPLATE
    for name, value in filled.items():
        text = text.replace(f"@{name}@", value)
    return text


def _rows(name: str, rows: Rows) -> str:
    return "\n".join(
        (
            _array("int", f"{name}_first", rows.first),
            _array("int", f"{name}_column", rows.column),
            _array("double", f"{name}_value", rows.value),
        )
    )


def _array(kind: str, name: str, values: Array) -> str:
    """Return a definition; an empty array has one entry that is never read, for C has none without entries."""
    listed = values if len(values) else np.zeros(1, dtype=values.dtype)
    words = [f"{value:.17g}" if kind == "double" else str(value) for value in listed.tolist()]
    words = [word if kind == "int" or any(c in word for c in ".en") else f"{word}.0" for word in words]
    lines = ",\n".join("    " + ", ".join(part) for part in _parts(words, 6 if kind == "double" else 16))
    return f"static const {kind} {name}[{len(words)}] = {{\n{lines}\n}};"


def _parts(words: Sequence[str], size: int) -> Iterable[Sequence[str]]:
    return (words[first : first + size] for first in range(0, len(words), size))


def _harmless(text: str) -> str:
    """Return a text that can stand in a comment."""
    return text.encode("ascii", "replace").decode().replace("*/", "* /").replace("/*", "/ *")
