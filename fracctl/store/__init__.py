"""Stored runs: directories, Parquet tables, identity and integrity."""

from fracctl.store.run_directory import RunDirectory, directory_of

__all__ = ["RunDirectory", "directory_of"]
