"""Stored runs: directories, Parquet tables, identity and integrity."""

from fracctl.store.run_directory import RunDirectory

__all__ = ["RunDirectory"]
