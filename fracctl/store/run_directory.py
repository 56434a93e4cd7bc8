"""The directory of one run: its paths, its state, its tables."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from fracctl.arrays import Array
from fracctl.errors import RunError
from fracctl.store import lock, manifest, tables
from fracctl.store.columns import records_table, to_rows, to_table
from fracctl.store.files import disk_errors, make_directory, move, remove_tree, write_bytes
from fracctl.store.identity import run_id

_ANEW = "the command that started it finds what is left of it"


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
        self.new_figures = self.path / manifest.NEW_FIGURES
        self.parts = self.path / manifest.PARTS
        self.log = self.path / manifest.LOG
        self.report = self.path / manifest.REPORT

    def __repr__(self) -> str:
        return f"RunDirectory({str(self.path)!r})"

    @property
    def lock(self) -> Path:
        """The lock file, beside the directory."""
        return self.path.with_name(f".{self.path.name}.lock")

    @property
    def run_json(self) -> dict[str, Any]:
        """Contents of ``run.json``: `status`, `run_id`, `configuration`, `provenance`, `summary`, `error`.

        Raises:
            RunError: the directory holds no run.
        """
        try:
            content = json.loads((self.path / "run.json").read_text(encoding="utf-8"))
        except OSError as problem:
            reason = f"run.json: {problem.strerror}; 'fracctl list runs' names those that are stored"
            raise RunError(f"{self.path} holds no run: {reason}") from problem
        except ValueError as problem:
            raise RunError(f"{self.path} holds no run: run.json is damaged ({problem}); {_ANEW}") from problem
        if not isinstance(content, dict):
            raise RunError(f"{self.path} holds no run: run.json is no mapping; {_ANEW}")
        return content

    @property
    def configuration(self) -> dict[str, Any]:
        """Configuration of the run, plain data.

        Raises:
            RunError: the directory holds no run.
        """
        configuration = self.run_json.get("configuration")
        if not isinstance(configuration, dict):
            raise RunError(f"{self.path} holds no run: run.json has no configuration; {_ANEW}")
        return configuration

    @property
    def status(self) -> str | None:
        """Word of ``run.json``: running, finished, incomplete, interrupted, failed; None where there is no run."""
        try:
            return str(self.run_json.get("status"))
        except RunError:
            return None

    @property
    def computed_by(self) -> str | None:
        """Id of the process that computes the run at this moment, None if none does."""
        return lock.holder(self.lock)

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

    @property
    def evaluations_columns(self) -> tuple[str, ...]:
        """Columns of the evaluated points."""
        return tables.columns(self.evaluations_path)

    def stream_evaluations(self) -> Iterator[dict[str, Array]]:
        """Yield every evaluated point, piece by piece, as arrays."""
        for table in tables.stream(self.evaluations_path):
            yield to_rows(table)

    def varies(self, column: str) -> bool:
        """Return whether the evaluated points have more than one value in a column of numbers."""
        known = np.zeros(0)
        for table in tables.stream(self.evaluations_path, [column]):
            values = table.column(column).to_numpy()
            values = values[~np.isnan(values)]
            known = known if known.size else values[:1]
            if np.any(values != known):
                return True
        return False

    def evaluations_where(self, wanted: Mapping[str, Sequence[Any]], columns: Sequence[str]) -> pd.DataFrame:
        """Return some columns of the points whose columns have one of the `wanted` values; only those are held."""
        found = [_chosen(table, wanted) for table in tables.stream(self.evaluations_path, list(columns))]
        return tables.to_pandas(pa.concat_tables(found))

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

    def writing_evaluations(self, schema: pa.Schema) -> AbstractContextManager[Callable[[pa.Table], None]]:
        """Return a context that gives what takes the rows, table by table; with its end they are stored."""
        return tables.writing(self.evaluations_path, schema)

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

    def clear(self) -> None:
        """Delete what is made of the parts, and open the run again; ``run.json`` and the log go on."""
        self.remove_manifest()
        kept = (self.parts, self.log, self.path / "run.json")
        with disk_errors(self.path):
            for path in set(self.path.iterdir()) - set(kept):
                remove_tree(path) if path.is_dir() else path.unlink()

    def set_aside(self) -> None:
        """Make room for computing again: a finished run is kept beside until `forget_aside`.

        One that is not finished is kept only where no other is kept already.
        """
        if self.has_manifest and (self.status == "finished" or not self.aside.exists()):
            remove_tree(self.aside)
            move(self.path, self.aside)
        else:
            remove_tree(self.path)

    def forget_aside(self) -> None:
        """Delete what `set_aside` kept."""
        remove_tree(self.aside)

    @property
    def kept(self) -> list[str]:
        """A sentence on the run that is kept beside, none where there is none."""
        return [f"the run that was stored here before is kept in {self.aside}"] if self.aside.exists() else []

    @property
    def aside(self) -> Path:
        """Where `set_aside` keeps a run."""
        return self.path.with_name(f".{self.path.name}.old")


def _chosen(table: pa.Table, wanted: Mapping[str, Sequence[Any]]) -> pa.Table:
    for name, values in wanted.items():
        table = table.filter(pc.is_in(table.column(name), pa.array(values, table.schema.field(name).type)))
    return table


def directory_of(configuration: Mapping[str, Any]) -> RunDirectory:
    """Return the run directory of a configuration, plain data."""
    return RunDirectory(Path(configuration["output_dir"]) / configuration["name"] / run_id(configuration))
