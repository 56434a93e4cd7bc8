"""Options of a run on a Dask cluster."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import InitErrorDetails

from fracctl.config.fields import Number, Typed, Whole, refusal, refuse

TLS_FILES = ("tls_ca_file", "tls_client_cert", "tls_client_key")

_ADDRESS = re.compile(r"(tcp|tls)://[^\s/]+:\d{1,5}")


class DaskScheduler(Typed):
    """Workers of a Dask cluster."""

    type: Literal["dask"] = "dask"
    address: str | None = None
    """``tcp://HOST:PORT`` or ``tls://HOST:PORT`` of its scheduler; None for a cluster on this machine."""
    workers: Annotated[Whole, Field(ge=1)] | None = None
    """How many processes there are on this machine; None for one a core."""
    patience_s: Annotated[Number, Field(gt=0.0)] = 30.0
    """How long to wait for the scheduler to answer, and for workers where there is none."""
    tls_ca_file: str | None = None
    """Certificates of the authority, PEM."""
    tls_client_cert: str | None = None
    """Certificate of this process, PEM."""
    tls_client_key: str | None = None
    """Its private key, PEM."""

    @model_validator(mode="after")
    def _fit_together(self) -> DaskScheduler:
        lines = [*self._address_lines(), *self._tls_lines()]
        if lines:
            raise refuse(*lines)
        return self

    def _address_lines(self) -> Iterator[InitErrorDetails]:
        if self.address is None:
            return
        if not _ADDRESS.fullmatch(self.address):
            allowed = "must be tcp://HOST:PORT or tls://HOST:PORT, as 'dask scheduler' prints it"
            yield refusal(("address",), self.address, allowed)
        if self.workers is not None:
            allowed = "goes without scheduler.address only; there, 'dask worker --nworkers N' says how many"
            yield refusal(("workers",), self.workers, allowed)

    def _tls_lines(self) -> Iterator[InitErrorDetails]:
        files = {name: getattr(self, name) for name in TLS_FILES}
        given = {name: path for name, path in files.items() if path is not None}
        for name, path in given.items():
            if not (self.address or "").startswith("tls://"):
                yield refusal((name,), path, "goes with scheduler.address=tls://HOST:PORT only")
        for name in files:
            if given and name not in given:
                yield refusal((name,), None, f"must be given where {next(iter(given))} is")
