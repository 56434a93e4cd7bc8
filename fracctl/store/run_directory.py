"""The directory of one run: its paths, its state, its tables."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from fracctl.arrays import Array
from fracctl.errors import RunError
from fracctl.store import manifest, tables
from fracctl.store.columns import records_table, to_rows, to_table
from fracctl.store.files import disk_errors, make_directory, move, remove_tree, write_bytes


class RunDirectory:
    """``<output_dir>/<experiment>/<run id>/``, finished or not.

    Args:
        path: of the directory; it need not exist.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path).absolute()
        self.evaluations_path = self.path / "evaluations.parquet"
        self.optima_path = self.path / "optima.parquet"
        self.poles_path = self.path / "poles.parquet"
        self.frequency_response_path = self.path / "frequency_response.parquet"
        self.trajectories_path = self.path / "trajectories.parquet"
        self.figures = self.path / "figures"
        self.parts = self.path / manifest.PARTS
        self.log = self.path / "run.log"
        self.report = self.path / manifest.REPORT

    def __repr__(self) -> str:
        return f"RunDirectory({str(self.path)!r})"

    @property
    def lock(self) -> Path:
        """The lock file, beside the directory."""
        return self.path.with_name(f".{self.path.name}.lock")

    @property
    def run_json(self) -> dict[str, Any]:
        """Contents of ``run.json``: `status`, `configuration`, `provenance`, `summary`, `error`.

        Raises:
            RunError: the directory holds no run.
        """
        try:
            content = json.loads((self.path / "run.json").read_text(encoding="utf-8"))
        except (OSError, ValueError) as problem:
            raise RunError(f"{self.path} holds no run: {problem}") from problem
        if not isinstance(content, dict):
            raise RunError(f"{self.path} holds no run: run.json is no mapping")
        return content

    @property
    def status(self) -> str | None:
        """Word of ``run.json``: running, finished, incomplete, interrupted, failed; None where there is no run."""
        try:
            return str(self.run_json.get("status"))
        except RunError:
            return None

    @property
    def has_manifest(self) -> bool:
        """Whether the manifest, the last file of a run, is there."""
        return (self.path / manifest.NAME).exists()

    def write_run_json(self, content: Mapping[str, Any]) -> None:
        """Replace ``run.json`` atomically."""
        write_bytes(self.path / "run.json", json.dumps(content, indent=2, ensure_ascii=False).encode() + b"\n")

    def evaluations(self, columns: Sequence[str] | None = None) -> pd.DataFrame:
        """Return every evaluated point, or some columns of them."""
        return tables.to_pandas(tables.read(self.evaluations_path, None if columns is None else list(columns)))

    def stream_evaluations(self) -> Iterator[dict[str, Array]]:
        """Yield every evaluated point, piece by piece, as arrays."""
        for table in tables.stream(self.evaluations_path):
            yield to_rows(table)

    def optima(self) -> pd.DataFrame:
        """Return the optima by kind, slice and objective."""
        return tables.to_pandas(tables.read(self.optima_path))

    def trajectories(self) -> pd.DataFrame:
        """Return the trajectories of the overall and baseline optima; `run` is their row of `optima`."""
        return tables.to_pandas(tables.read(self.trajectories_path))

    def poles(self) -> pd.DataFrame:
        """Return poles and pseudo-state eigenvalues of the overall and baseline optima; `run` is their row."""
        return tables.to_pandas(tables.read(self.poles_path))

    def frequency_response(self) -> pd.DataFrame:
        """Return the frequency responses of the overall and baseline optima; `run` is their row."""
        return tables.to_pandas(tables.read(self.frequency_response_path))

    def write_evaluations(self, schema: pa.Schema, parts: Iterable[pa.Table]) -> None:
        """Join the parts."""
        tables.write(self.evaluations_path, schema, parts)

    def write_optima(self, schema: pa.Schema, optima: Iterable[Mapping[str, Any]]) -> None:
        """Write the optima, one mapping a row."""
        tables.write(self.optima_path, schema, [records_table(optima, schema)])

    def write_poles(self, schema: pa.Schema, rows: Mapping[str, Array]) -> None:
        """Write the poles."""
        tables.write(self.poles_path, schema, [to_table(rows, schema)])

    def write_frequency_response(self, schema: pa.Schema, rows: Mapping[str, Array]) -> None:
        """Write the frequency responses."""
        tables.write(self.frequency_response_path, schema, [to_table(rows, schema)])

    def write_trajectories(self, schema: pa.Schema, rows: Mapping[str, Array]) -> None:
        """Write the trajectories."""
        tables.write(self.trajectories_path, schema, [to_table(rows, schema)])

    def table(self, name: str) -> pd.DataFrame:
        """Return a further table of the run, ``<name>.parquet``."""
        return tables.to_pandas(tables.read(self.path / f"{name}.parquet"))

    def write_table(self, name: str, schema: pa.Schema, records: Iterable[Mapping[str, Any]]) -> None:
        """Write a further table, one mapping a row, as Parquet and as CSV."""
        table = records_table(records, schema)
        tables.write(self.path / f"{name}.parquet", schema, [table])
        text = tables.to_pandas(table).to_csv(index=False, lineterminator="\n")
        write_bytes(self.path / f"{name}.csv", text.encode())

    def write_manifest(self) -> None:
        """Write the digests of all files; from now on the run is finished, and a report of what it was before gone."""
        with disk_errors(self.report):
            self.report.unlink(missing_ok=True)
        manifest.write(self.path)

    def remove_manifest(self) -> None:
        """Open a run that has a manifest again."""
        (self.path / manifest.NAME).unlink(missing_ok=True)

    def verify(self) -> list[str]:
        """Return a sentence for every file that is not as it was written; none if the run is whole."""
        return manifest.verify(self.path)

    def create(self) -> None:
        """Create the directory."""
        make_directory(self.path)

    def set_aside(self) -> None:
        """Make room for computing again: a finished run is kept beside until `forget_aside`, any other is deleted."""
        if self.has_manifest:
            remove_tree(self._aside)
            move(self.path, self._aside)
        else:
            remove_tree(self.path)

    def forget_aside(self) -> None:
        """Delete what `set_aside` kept."""
        remove_tree(self._aside)

    @property
    def _aside(self) -> Path:
        return self.path.with_name(f".{self.path.name}.old")
