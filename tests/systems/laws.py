"""First-order forms of loops of integer order, written out from the equations of their laws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from tests.references import loops

OUT_OF_PLANE = np.array(loops.OUT_OF_PLANE_STIFFNESS), np.array(loops.OUT_OF_PLANE_DAMPING)
IN_PLANE = np.array(loops.IN_PLANE_STIFFNESS), np.array(loops.IN_PLANE_DAMPING)


@dataclass(frozen=True)
class FirstOrder:
    """x' = A x, υ = C x with x = [ξ, ξ', ∫ξ, z]; z of m entries, or of none."""

    matrix: np.ndarray
    output: np.ndarray

    def states(self, start: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return x from [ξ(0), ξ'(0)], (t, n)."""
        first = np.concatenate([start, np.zeros(len(self.matrix) - len(start))])
        return np.array([scipy.linalg.expm(self.matrix * t) @ first for t in times])


def pid(stiffness: np.ndarray, damping: np.ndarray, k_p: object, k_i: object, k_d: object) -> FirstOrder:
    """Return ξ'' = S ξ + D ξ' + υ with υ = -K_P ξ - K_I ∫ξ - K_D ξ'."""
    m = len(stiffness)
    k_p, k_i, k_d = (np.reshape(gain, (m, m)) for gain in (k_p, k_i, k_d))
    one, no = np.eye(m), np.zeros((m, m))
    output = np.hstack([-k_p, -k_d, -k_i])
    rows = [np.hstack([no, one, no]), np.hstack([stiffness, damping, no]) + output, np.hstack([one, no, no])]
    return FirstOrder(np.vstack(rows), output)


def filtered_pid(
    stiffness: np.ndarray, damping: np.ndarray, k_p: object, k_i: object, k_d: object, time_constant: object
) -> FirstOrder:
    """Return the same with υ = -K_P ξ - K_I ∫ξ - K_D z, T_f z' = ξ' - z."""
    m = len(stiffness)
    k_p, k_i, k_d = (np.reshape(gain, (m, m)) for gain in (k_p, k_i, k_d))
    one, no, rate = np.eye(m), np.zeros((m, m)), np.diag(1.0 / np.broadcast_to(time_constant, m))
    output = np.hstack([-k_p, no, -k_i, -k_d])
    rows = [
        np.hstack([no, one, no, no]),
        np.hstack([stiffness, damping, no, no]) + output,
        np.hstack([one, no, no, no]),
        np.hstack([no, rate, no, -rate]),
    ]
    return FirstOrder(np.vstack(rows), output)
