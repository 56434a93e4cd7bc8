"""Parquet files with page checksums: serialised, streamed, read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from fracctl.errors import RunError
from fracctl.store.files import atomic

ROWS_IN_GROUP = 65_536
"""Smaller parts are joined to row groups of about this size."""

_COMPRESSION = "zstd"


def _options(schema: pa.Schema) -> dict[str, Any]:
    """How tables are written. Dictionaries of words only: those of numbers take three times as long, and more room."""
    words = [field.name for field in schema if field.type == pa.string()]
    return {"compression": _COMPRESSION, "write_page_checksum": True, "use_dictionary": words or False}


def serialise(table: pa.Table) -> bytes:
    """Return a table as the bytes of a Parquet file."""
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, **_options(table.schema))
    content: bytes = sink.getvalue().to_pybytes()
    return content


def deserialise(content: bytes) -> pa.Table:
    """Read the bytes of a Parquet file, verifying every page."""
    return pq.read_table(pa.BufferReader(content), page_checksum_verification=True)


@contextmanager
def writing(path: Path, schema: pa.Schema) -> Iterator[Callable[[pa.Table], None]]:
    """Yield what takes tables that follow each other; the file is there when all of them are, or not at all."""
    with (
        atomic(path) as file,
        pq.ParquetWriter(file, schema, **_options(schema)) as writer,
    ):
        waiting: list[pa.Table] = []

        def write_group() -> None:
            group = pa.concat_tables(waiting).combine_chunks()
            waiting.clear()
            writer.write_table(group.replace_schema_metadata(schema.metadata))

        def take(table: pa.Table) -> None:
            waiting.append(table)
            if sum(part.num_rows for part in waiting) >= ROWS_IN_GROUP:
                write_group()

        yield take
        if waiting:
            write_group()
    _give_back()


def write(path: Path, schema: pa.Schema, tables: Iterable[pa.Table]) -> None:
    """Write tables that follow each other to one file, atomically and without holding them all."""
    with writing(path, schema) as take:
        for table in tables:
            take(table)


def read(path: Path, columns: list[str] | None = None) -> pa.Table:
    """Read a file, verifying every page.

    Raises:
        RunError: it is not there, or damaged.
    """
    with _read_errors(path):
        return pq.read_table(path, columns=columns, page_checksum_verification=True)


@contextmanager
def _read_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, pa.ArrowException) as problem:
        raise RunError(f"cannot read {path}: {problem}") from problem


def _give_back() -> None:
    """Return what Arrow has kept for further tables to the system."""
    pa.default_memory_pool().release_unused()


def stream(path: Path, columns: list[str] | None = None) -> Iterator[pa.Table]:
    """Read a file row group by row group, verifying every page."""
    with _read_errors(path), pq.ParquetFile(path, page_checksum_verification=True) as file:
        for number in range(file.num_row_groups):
            yield file.read_row_group(number, columns, use_threads=False)  # each thread would keep memory of its own
    _give_back()


def columns(path: Path) -> tuple[str, ...]:
    """Return the names of a file's columns."""
    with _read_errors(path):
        return tuple(pq.read_schema(path).names)


def to_pandas(table: pa.Table) -> pd.DataFrame:
    """Return a table as a data frame; verdicts are nullable booleans."""
    kinds = {pa.bool_(): pd.BooleanDtype()}
    frame: pd.DataFrame = table.to_pandas(types_mapper=kinds.get)
    return frame
