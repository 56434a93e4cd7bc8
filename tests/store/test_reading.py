"""Tables of a real run in the hands of other readers: the same numbers, words, nulls and footers in all of them."""

from __future__ import annotations

import json
import math
from pathlib import Path

import duckdb
import pandas as pd
import polars as pl
import pyarrow.parquet as pq
import pytest

import fracctl as fc

AXES = ["survey.axes.alpha_w=[0.91,1.0]", "survey.axes.k_p_w=[0.0,0.85]", "survey.axes.k_d_w=[0.0,2.0]"]
COLUMNS = ["alpha_w", "k_p_w", "k_d_w", "settling_time", "status", "stable", "reason"]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("outputs")
    return fc.run("ic1_outofplane", [*AXES, "figures=null", f"output_dir={output}"]).run_directory


def by_pyarrow(path: Path) -> list[tuple[object, ...]]:
    return [tuple(row.values()) for row in pq.read_table(path, columns=COLUMNS).to_pylist()]


def by_pandas(path: Path) -> list[tuple[object, ...]]:
    table = pd.read_parquet(path)[COLUMNS]
    return [tuple(None if pd.isna(cell) else cell for cell in row) for row in table.itertuples(index=False, name=None)]


def by_duckdb(path: Path) -> list[tuple[object, ...]]:
    return duckdb.sql(f"select {', '.join(COLUMNS)} from '{path}'").fetchall()


def by_polars(path: Path) -> list[tuple[object, ...]]:
    return pl.read_parquet(path).select(COLUMNS).rows()


@pytest.mark.parametrize("read", [by_pandas, by_duckdb, by_polars])
def test_a_reader_finds_the_rows_of_a_run(run: Path, read: object) -> None:
    path = run / "evaluations.parquet"
    expected = by_pyarrow(path)
    assert len(expected) == 8
    settled = [row for row in expected if row[4] == "ok"]
    assert all(0.0 < row[3] < 12 * math.pi and row[5] is True for row in settled)
    assert {row[5] for row in expected} == {True, None}, "without damping the verdict is open"
    assert any(math.isinf(row[3]) for row in expected), "what does not settle has no time"
    assert read(path) == expected  # type: ignore[operator]


@pytest.mark.parametrize("name", ["evaluations", "optima", "trajectories", "poles", "frequency_response"])
def test_every_table_is_read_by_all(run: Path, name: str) -> None:
    path = run / f"{name}.parquet"
    table = pq.read_table(path)
    assert table.num_rows > 0
    assert pd.read_parquet(path).shape == table.shape
    assert pl.read_parquet(path).shape == table.shape
    relation = duckdb.sql(f"select * from '{path}'")
    assert relation.shape == table.shape
    assert relation.columns == table.column_names


def test_all_read_the_footer(run: Path) -> None:
    path = run / "optima.parquet"
    configuration = json.loads((run / "run.json").read_text(encoding="utf-8"))["configuration"]
    by_name = pl.read_parquet_metadata(path)
    pairs = duckdb.sql(f"select decode(key), decode(value) from parquet_kv_metadata('{path}')").fetchall()
    for footer in (by_name, dict(pairs)):
        assert json.loads(footer["fracctl.configuration"]) == configuration
        assert json.loads(footer["fracctl.provenance"])["seed"] == 0
