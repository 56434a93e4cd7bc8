"""Parts and tables: what is written comes back bit by bit, and damage is noticed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fracctl.errors import RunError
from fracctl.store import RunDirectory, columns, tables
from fracctl.store.parts import Parts
from tests.store.disks import full_after, small_disk

NAMES = ("point", "initial_condition", "alpha_w", "drift_per_orbit_km", "status", "stable", "nodes", "reason")
SCHEMA = columns.schema(NAMES, counters=("nodes",), metadata={"fracctl.configuration": "{}"})


def rows(first: int = 0, n_rows: int = 50) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(first)
    return {
        "point": np.arange(first, first + n_rows),
        "initial_condition": np.array(["ic1"] * n_rows),
        "alpha_w": rng.random(n_rows),
        "drift_per_orbit_km": np.where(rng.random(n_rows) < 0.2, np.nan, np.inf),
        "status": np.array(["ok", "unsettled"] * (n_rows // 2), dtype=object),
        "stable": np.array([True, None] * (n_rows // 2), dtype=object),
        "nodes": rng.integers(0, 100, n_rows),
    }


def assert_equal(found: dict[str, np.ndarray] | None, expected: dict[str, np.ndarray]) -> None:
    assert found is not None
    for name, values in expected.items():
        if values.dtype.kind in "fi":
            assert found[name].dtype == values.dtype
            assert found[name].tobytes() == values.tobytes(), name
        else:
            assert found[name].tolist() == values.tolist(), name


def test_rows_come_back_bit_by_bit(tmp_path: Path) -> None:
    Parts(tmp_path / "parts", SCHEMA).save(3, rows())
    found = Parts(tmp_path / "parts", SCHEMA).load(3)
    assert_equal(found, rows())
    assert found is not None
    assert found["reason"].tolist() == [None] * 50
    assert (tmp_path / "parts" / "000003.parquet").exists()


def test_a_part_that_is_not_there_is_to_be_computed(tmp_path: Path) -> None:
    assert Parts(tmp_path, SCHEMA).load(0) is None


def test_a_failed_block_is_kept_but_tried_again(tmp_path: Path) -> None:
    parts = Parts(tmp_path, SCHEMA)
    failed = rows() | {"nodes": np.array([None] * 50, dtype=object), "reason": np.array(["boom"] * 50, dtype=object)}
    parts.save(0, failed, failed="boom")
    assert parts.load(0) is None
    (table,) = parts.tables([0])
    assert table.column("reason").to_pylist() == ["boom"] * 50
    assert table.column("nodes").null_count == 50
    parts.save(0, rows())
    assert_equal(parts.load(0), rows())


def test_any_flipped_byte_is_noticed(tmp_path: Path) -> None:
    parts = Parts(tmp_path, SCHEMA)
    parts.save(0, rows())
    path = tmp_path / "000000.parquet"
    content = path.read_bytes()
    for place in range(0, len(content), 37):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :])
        assert parts.load(0) is None
        assert not path.exists()
        path.with_suffix(".parquet.bad").unlink()
    path.write_bytes(content[:-100])
    assert parts.load(0) is None
    path.write_bytes(content)
    assert_equal(parts.load(0), rows())


def test_a_part_without_its_digest_is_not_trusted(tmp_path: Path) -> None:
    parts = Parts(tmp_path, SCHEMA)
    for number in range(3):
        parts.save(number, rows(number))
    digests = tmp_path / "sha256"
    digests.write_bytes(digests.read_bytes()[:-40])
    again = Parts(tmp_path, SCHEMA)
    assert again.load(2) is None
    assert again.damaged == 1
    again.save(2, rows(2))
    assert_equal(Parts(tmp_path, SCHEMA).load(2), rows(2))
    assert_equal(Parts(tmp_path, SCHEMA).load(1), rows(1))


def test_a_part_of_another_table_is_not_trusted(tmp_path: Path) -> None:
    Parts(tmp_path, SCHEMA).save(0, rows())
    assert Parts(tmp_path, columns.schema(NAMES[:3])).load(0) is None


def test_what_a_killed_process_left_half_written_goes(tmp_path: Path) -> None:
    (tmp_path / "000000.parquet.tmp").write_bytes(b"half")
    Parts(tmp_path, SCHEMA)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_keeps_the_parts_before(tmp_path: Path) -> None:
    parts = Parts(tmp_path, SCHEMA)
    parts.save(0, rows(0))
    with full_after(1000), pytest.raises(RunError, match=r"000001.parquet: No space left on device"):
        parts.save(1, rows(1))
    again = Parts(tmp_path, SCHEMA)
    assert_equal(again.load(0), rows(0))
    assert again.load(1) is None
    assert again.damaged == 0


def test_a_really_full_disk(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", "64k") as disk:
        parts, kept = Parts(disk, SCHEMA), []

        def fill() -> None:
            for number in range(100):
                parts.save(number, rows(number))
                kept.append(number)

        with pytest.raises(RunError, match="No space left on device"):
            fill()
        assert kept
        again = Parts(disk, SCHEMA)
        for number in kept:
            assert_equal(again.load(number), rows(number))


def test_the_tables_carry_types_units_and_metadata(tmp_path: Path) -> None:
    Parts(tmp_path, SCHEMA).save(0, rows())
    stored = pq.read_schema(tmp_path / "000000.parquet")
    assert stored.metadata[b"fracctl.configuration"] == b"{}"
    assert stored.field("drift_per_orbit_km").metadata[b"unit"] == b"km"
    assert stored.field("alpha_w").metadata[b"unit"] == b"1"
    assert stored.field("nodes").type == pa.int64()
    assert stored.field("stable").type == pa.bool_()


def test_parts_are_joined_in_order_and_large_groups(tmp_path: Path) -> None:
    parts = Parts(tmp_path / "parts", SCHEMA)
    for number in (2, 0, 1):
        parts.save(number, rows(100 * number))
    run = RunDirectory(tmp_path)
    with run.writing_evaluations(SCHEMA) as take:
        for table in parts.tables([0, 1, 2]):
            take(table)
    assert run.evaluations(["point"])["point"].tolist() == [first + i for first in (0, 100, 200) for i in range(50)]
    assert pq.ParquetFile(run.evaluations_path).num_row_groups == 1
    assert pq.read_schema(run.evaluations_path).metadata[b"fracctl.configuration"] == b"{}"
    frame = run.evaluations()
    assert str(frame["stable"].dtype) == "boolean"
    assert frame["stable"].isna().sum() == 75
    (streamed,) = run.stream_evaluations()
    assert streamed["alpha_w"].tobytes() == frame["alpha_w"].to_numpy().tobytes()


def test_a_full_disk_while_joining(tmp_path: Path) -> None:
    parts = Parts(tmp_path / "parts", SCHEMA)
    parts.save(0, rows())
    run = RunDirectory(tmp_path)
    with (
        full_after(500),
        pytest.raises(RunError, match=r"evaluations.parquet: No space left on device"),
        run.writing_evaluations(SCHEMA) as take,
    ):
        take(next(parts.tables([0])))
    assert not run.evaluations_path.exists()


def test_a_table_that_cannot_be_read_is_one_sentence(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path)
    with pytest.raises(RunError, match=r"cannot read .*optima.parquet"):
        run.optima()
    tables.write(run.optima_path, SCHEMA, [columns.to_table(rows(), SCHEMA)])
    content = bytearray(run.optima_path.read_bytes())
    content[60] ^= 0xFF
    run.optima_path.write_bytes(bytes(content))
    with pytest.raises(RunError, match=r"cannot read .*optima.parquet"):
        run.optima()


def test_some_points_and_columns_of_a_table(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path)
    with run.writing_evaluations(SCHEMA) as take:
        for first in (0, 100, 200):
            take(columns.to_table(rows(first), SCHEMA))
    whole = run.evaluations()
    assert run.evaluations_columns == tuple(whole.columns)
    wanted = whole["alpha_w"].unique()[:2].tolist()
    found = run.evaluations_where({"alpha_w": wanted, "status": ["ok"]}, ["alpha_w", "status", "point"])
    expected = whole[whole["alpha_w"].isin(wanted) & (whole["status"] == "ok")][["alpha_w", "status", "point"]]
    pd.testing.assert_frame_equal(found, expected.reset_index(drop=True))
    assert {name: run.varies(name) for name in ("point", "alpha_w")} == {
        name: whole[name].nunique() > 1 for name in ("point", "alpha_w")
    }
