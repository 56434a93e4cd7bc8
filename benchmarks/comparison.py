"""The engine and its peers on the same loop, each at its own error.

Every peer is timed for positions and controls alone; the engine for these with three measures and the certificate.
Of the settings on a peer's ladder the one that is judged is the cheapest that comes within the engine's tolerance on
all checked loops, or, where none does, the most accurate one; the package as it comes is judged beside it.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import Any

import pandas as pd

from benchmarks import machine
from benchmarks.cases import Case, Truth, case
from benchmarks.peers.base import Peer
from benchmarks.throughput import TOLERANCE, engine_error
from benchmarks.timing import Task, Timing, ratio, take_turns
from benchmarks.verdicts import Verdict, at_least

ROUNDS = 5
ASKED = {("pycaputo", "implicit product integration"): 20_000.0, ("nilt-python", "de Hoog"): 1000.0}
_STACKED = 16
_CHECKED = 4
ENGINE = "fracctl"


def catalogue() -> tuple[list[Peer], list[str]]:
    """Return the peers in all their settings, and a sentence for each package that is missing."""
    peers: list[Peer] = []
    missing = []
    for name, settings in (
        ("product_integration", _product_integration),
        ("laplace", _laplace),
        ("mittag_leffler", _mittag_leffler),
    ):
        try:
            peers += settings(import_module(f"benchmarks.peers.{name}"))
        except ModuleNotFoundError as error:
            missing.append(f"{error.name} is not installed (extra `bench`)")
    return peers, missing


def _product_integration(module: Any) -> list[Peer]:
    settings: list[Peer] = [module.ProductIntegration(steps) for steps in (200, 800, 3200)]
    stacked = [module.ProductIntegration(steps, loops=_STACKED) for steps in (100, 200, 400, 800)]
    return [*settings, *stacked, module.ProductIntegration(3200, own_root_finder=True)]


def _laplace(module: Any) -> list[Peer]:
    options = [{"M": m, "T_FACTOR": t} for m, t in ((10, 1), (10, 2), (15, 1), (15, 2), (20, 1), (20, 2), (30, 2))]
    de_hoog: list[Peer] = [module.InverseLaplace("DeHoog", option) for option in options]
    talbot = [module.InverseLaplace("Talbot", {"N": n}) for n in (24, 32, 64)]
    return [*de_hoog, module.InverseLaplace("DeHoog", {}, ladder=False), *talbot]


def _mittag_leffler(module: Any) -> list[Peer]:
    return [module.MittagLeffler()]


def measure() -> tuple[pd.DataFrame, list[Verdict], list[str]]:
    """Time engine and peers in turn, in each plane; return table, verdicts and notes."""
    peers, missing = catalogue()
    tables, verdicts = [], []
    for plane in ("out-of-plane", "in-plane"):
        tables.append(_one_plane(case(plane), peers))
        verdicts += _verdicts(plane, tables[-1])
    return pd.concat(tables, ignore_index=True), verdicts, missing


def _one_plane(batch: Case, peers: list[Peer]) -> pd.DataFrame:
    horizon = batch.evaluation.horizon
    members = [batch.loop(member) for member in range(_STACKED)]
    truth = Truth(members[:_CHECKED], horizon)
    tasks: dict[str, Task] = {ENGINE: batch.rows}
    tasks |= {label(peer): partial(peer, members[: peer.loops], horizon) for peer in peers}
    units = {ENGINE: batch.size} | {label(peer): peer.loops for peer in peers}
    timings = take_turns(tasks, units, ROUNDS)
    engine = (ENGINE, "contour", "with measures and certificate")
    rows = [_row(batch.plane, engine, engine_error(batch), timings, ENGINE) | {"ladder": False}]
    for peer in peers:
        words = (peer.package, peer.method, peer.setting)
        error = peer_error(peer, members, truth, horizon)
        rows.append(_row(batch.plane, words, error, timings, label(peer)) | {"ladder": peer.ladder})
    return pd.DataFrame(rows)


def label(peer: Peer) -> str:
    """Return a name that no other peer or setting has."""
    return f"{peer.package}, {peer.method}, {peer.setting}"


def peer_error(peer: Peer, members: list[Any], truth: Truth, horizon: float) -> float:
    """Return the peer's largest error on the loops with references."""
    solutions = []
    for first in range(0, _CHECKED, peer.loops):
        solutions += peer(members[first : first + peer.loops], horizon)
    return max(truth.error(i, s.times, s.positions, s.controls) for i, s in enumerate(solutions[:_CHECKED]))


def _row(plane: str, words: tuple[str, str, str], error: float, timings: dict[str, Timing], key: str) -> dict[str, Any]:
    timing = timings[key]
    return {
        "plane": plane,
        "package": words[0],
        "method": words[1],
        "setting": words[2],
        "error": error,
        "ms": 1e3 * timing.seconds,
        "spread": timing.spread,
        "over the engine": ratio(timing, timings[ENGINE]),
        "load": machine.load(),
    }


def judged(rows: pd.DataFrame) -> pd.Series:
    """Return the row of a method's setting that is compared, see above."""
    enough = rows[rows["error"] <= TOLERANCE]
    ordered = enough.sort_values("ms") if len(enough) else rows.sort_values("error")
    return ordered.iloc[0]


def _verdicts(plane: str, table: pd.DataFrame) -> list[Verdict]:
    verdicts = []
    for (package, method), asked in ASKED.items():
        rows = table[(table["package"] == package) & (table["method"] == method)]
        if len(rows):
            usual = rows[~rows["ladder"]]
            for row in (judged(rows[rows["ladder"]]), *(row for _, row in usual.iterrows())):
                words = f"{package} over the engine, {plane}: {row['setting']}, error {row['error']:.0e}"
                verdicts.append(at_least(words, asked, float(row["over the engine"])))
    return verdicts
