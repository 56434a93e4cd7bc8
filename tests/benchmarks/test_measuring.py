"""What the benchmarks count, compare and print."""

from __future__ import annotations

import math
import time

import numpy as np
import pandas as pd
import pytest

from benchmarks import cases, limit, report
from benchmarks.comparison import judged
from benchmarks.peers.base import output_times
from benchmarks.processes import run
from benchmarks.throughput import engine_error
from benchmarks.timing import Timing, ratio, take_turns
from benchmarks.verdicts import at_least, at_most, number


def test_tasks_take_turns_and_times_are_per_unit() -> None:
    order: list[str] = []

    def task(name: str, seconds: float) -> None:
        order.append(name)
        end = time.process_time() + seconds
        while time.process_time() < end:
            pass

    timings = take_turns({"a": lambda: task("a", 0.02), "b": lambda: task("b", 0.01)}, {"a": 10, "b": 1}, rounds=3)
    assert order == ["a", "b"] * 4
    assert timings["a"].seconds == pytest.approx(0.002, rel=0.2)
    assert timings["b"].on_the_clock >= 0.01


def test_ratios_are_paired() -> None:
    slow = Timing(np.array([2.0, 40.0, 6.0]), np.ones(3))
    fast = Timing(np.array([1.0, 10.0, 2.0]), np.ones(3))
    assert ratio(slow, fast) == 3.0


def test_the_limit_covers_all_times_with_all_nodes() -> None:
    assert sum(limit.counts()) == limit.TIMES
    assert limit.counts() == sorted(limit.counts())
    assert len(limit.counts()) == len(limit.NODES)
    limit.products(limit.CHUNK + 3, 2)()


@pytest.mark.parametrize("plane", ["out-of-plane", "in-plane"])
def test_a_batch_is_what_its_loops_say(plane: str) -> None:
    batch = cases.case(plane, 8)
    assert batch.size == 8
    assert list(batch.design) == list(batch.evaluation.design_variables)
    assert batch.evaluation.horizon == pytest.approx(4.0 * math.pi)
    assert set(batch.rows()["status"]) <= {"ok", "unsettled"}
    assert engine_error(batch) < 1e-8


def test_gains_stand_in_their_columns() -> None:
    design = cases.case("in-plane", gains=np.arange(8.0).reshape(1, 2, 4)).design
    columns = ("k_p_u", "k_p_uv", "k_d_u", "k_d_uv", "k_p_vu", "k_p_v", "k_d_vu", "k_d_v")
    assert [float(design[name][0]) for name in columns] == list(range(8))


def test_a_wrong_trajectory_shows() -> None:
    batch = cases.case("out-of-plane", 2)
    times = output_times(batch.evaluation.horizon)
    truth = cases.Truth([batch.loop(0)], batch.evaluation.horizon)
    positions, controls = batch.trajectory(0, times)
    assert truth.error(0, times, positions, controls) < 1e-8
    assert truth.error(0, times, positions, -controls) > 1.0
    assert truth.error(0, times, positions * np.nan, controls) == math.inf
    assert truth.error(0, times, *batch.trajectory(1, times)) > 1e-3


def test_the_setting_that_is_judged() -> None:
    rows = pd.DataFrame({"error": [1e-3, 1e-9, 1e-10], "ms": [1.0, 2.0, 3.0]})
    assert judged(rows)["ms"] == 2.0
    assert judged(rows.iloc[:1])["ms"] == 1.0
    assert judged(pd.DataFrame({"error": [1e-3, 1e-5], "ms": [1.0, 9.0]}))["ms"] == 9.0


def test_verdicts() -> None:
    assert at_least("rate", 150_000.0, 150_000.0).met
    assert not at_least("rate", 150_000.0, 149_999.0).met
    assert at_most("error", 1e-8, 1e-8).met
    assert not at_most("error", 1e-8, math.inf).met
    assert not at_least("rate", 1.0, math.nan).met


@pytest.mark.parametrize(
    ("value", "words"), [(150_000.0, "150 000"), (4.0, "4"), (8.736, "8.74"), (3.2e-11, "3.2e-11"), (0.0341, "0.0341"),
                         (math.nan, ""), (math.inf, "inf"), (0.0, "0")]
)  # fmt: skip
def test_numbers_in_tables(value: float, words: str) -> None:
    assert number(value) == words


def test_tables_are_markdown() -> None:
    table = pd.DataFrame({"what": ["a|b", "c"], "met": [True, False], "µs": [1.0, 1234.5]})
    assert report.markdown(table).splitlines() == [
        "| what | met |    µs |",
        "|------|-----|------:|",
        r"| a\|b | yes |     1 |",
        "| c    | no  | 1 234 |",
    ]


def test_processes_are_timed_weighed_and_must_succeed() -> None:
    done = run(["-c", "import time; time.sleep(0.05); x = bytearray(50_000_000); print(len(x))"])
    assert done.output.strip() == "50000000"
    assert done.seconds > 0.05
    assert done.peak_mib > 50_000_000 / 2**20
    with pytest.raises(RuntimeError, match="ended with 3"):
        run(["-c", "raise SystemExit(3)"])
