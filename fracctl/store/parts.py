"""Parts of an unfinished run: one Parquet file a block, named by its number."""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import pyarrow as pa

from fracctl.arrays import Array
from fracctl.errors import RunError
from fracctl.store import columns, tables
from fracctl.store.files import TEMPORARY, disk_errors, make_directory, move, write_bytes

BAD = ".bad"
"""Suffix of a part that was moved aside."""

_DIGESTS = "sha256"
_FAILED = b"fracctl.failed"

_log = logging.getLogger(__name__)


class Parts:
    """The parts in a directory.

    A part is trusted if its SHA-256 is the one that was noted before it was written and every page has its checksum.

    Args:
        directory: created if it is not there.
        schema: of every part, its metadata included.
    """

    def __init__(self, directory: Path, schema: pa.Schema) -> None:
        self._directory = directory
        self._schema = schema
        self.damaged = 0
        """Number of parts that were moved aside."""
        make_directory(directory)
        with disk_errors(directory):
            for left in directory.glob(f"*{TEMPORARY}"):
                left.unlink()
        self._digests = dict(read_digests(directory))

    def save(self, number: int, rows: Mapping[str, Array], failed: str | None = None) -> pa.Table:
        """Write the rows of a block and return them; `failed` says why the block could not be computed."""
        metadata = dict(self._schema.metadata or {}) | ({_FAILED: failed.encode()} if failed else {})
        table = columns.to_table(rows, self._schema)
        content = tables.serialise(table.replace_schema_metadata(metadata))
        self._note(number, hashlib.sha256(content).hexdigest())
        write_bytes(self._path(number), content)
        return table

    def load(self, number: int) -> dict[str, Array] | None:
        """Return the rows of a block; None where they are still to be computed, or to be tried again."""
        table = self._table(number)
        if table is None or reason_of(table) is not None:
            return None
        return columns.to_rows(table)

    def tables(self, numbers: Iterable[int]) -> Iterator[pa.Table]:
        """Yield the tables of blocks that were saved, each verified again."""
        for number in numbers:
            table = self._table(number)
            if table is None:
                path = self._path(number)
                raise RunError(f"{path} was damaged while the run was computed; the same command computes it again")
            yield table

    def _table(self, number: int) -> pa.Table | None:
        path = self._path(number)
        if not path.exists():
            return None
        try:
            return self._verified(path)
        except (OSError, ValueError, pa.ArrowException) as problem:
            _log.warning("part %s is computed again: %s", path.name, problem)
            move(path, path.with_name(path.name + BAD))
            self.damaged += 1
            return None

    def _verified(self, path: Path) -> pa.Table:
        table = verified(path, self._digests)
        if not table.schema.equals(self._schema, check_metadata=False):
            raise ValueError("its columns are not those of this run")
        return table

    def _note(self, number: int, digest: str) -> None:
        path = self._directory / _DIGESTS
        with disk_errors(path), path.open("a", encoding="ascii") as file:
            file.write(f"\n{digest}  {self._path(number).name}\n")
            file.flush()
            os.fsync(file.fileno())
        self._digests[self._path(number).name] = digest

    def _path(self, number: int) -> Path:
        return self._directory / f"{number:06d}.parquet"


def verified(path: Path, digests: Mapping[str, str]) -> pa.Table:
    """Read a part.

    Raises:
        OSError, ValueError, pa.ArrowException: it cannot be trusted.
    """
    content = path.read_bytes()
    if hashlib.sha256(content).hexdigest() != digests.get(path.name):
        raise ValueError("its SHA-256 is not the one noted for it")
    return tables.deserialise(content)


def reason_of(table: pa.Table) -> str | None:
    """Return why the block of a part could not be computed, None if it was."""
    reason: bytes | None = (table.schema.metadata or {}).get(_FAILED)
    return None if reason is None else reason.decode()


def read_digests(directory: Path) -> Iterator[tuple[str, str]]:
    """Yield name and digest of every part; a line that was cut off names none."""
    try:
        lines = (directory / _DIGESTS).read_bytes().decode("ascii", errors="replace").splitlines()
    except FileNotFoundError:
        return
    for line in lines:
        digest, _, name = line.partition("  ")
        yield name, digest
