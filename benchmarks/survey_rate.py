"""Evaluations a second on one core: a slice of gains with trajectory, control, three measures and certificate each."""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import time

import numpy as np

from fracctl.config.build import build_evaluation
from fracctl.config.compose import compose

REPEATS = 5
GAINS = np.round(np.arange(0.0, 2.0 + 1e-9, 0.05), 2)


def rate(experiment: str, alpha: float) -> tuple[float, float]:
    """Best and median evaluations a second over the 41 × 41 gains of one order."""
    evaluation = build_evaluation(compose([f"experiment={experiment}"], None))
    k_p, k_d = (gain.ravel() for gain in np.meshgrid(GAINS, GAINS, indexing="ij"))
    design = {"alpha_w": np.full(k_p.size, alpha), "k_p_w": k_p, "k_d_w": k_d}
    evaluation(design)
    rates = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        rows = evaluation(design)
        rates.append(len(rows["objective"]) / (time.perf_counter() - start))
    return max(rates), float(np.median(rates))


if __name__ == "__main__":
    print(f"{'experiment':16} {'alpha_w':>8} {'best, 1/s':>12} {'median, 1/s':>12}")
    for name in ("ic1_outofplane", "outofplane"):
        for order in (1.0, 0.91):
            best, median = rate(name, order)
            print(f"{name:16} {order:8g} {best:12,.0f} {median:12,.0f}")
