"""What the parts of an unfinished run hold, without changing them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from fracctl.store.parts import read_digests, reason_of, verified
from fracctl.surveys.base import POINT


@dataclass
class Inspection:
    """Points and parts of an unfinished run."""

    points: int = 0
    """Points, or searches, that are stored and can be trusted."""
    failed: dict[str, str] = field(default_factory=dict)
    """Reason by the name of each part whose points could not be computed."""
    damaged: dict[str, str] = field(default_factory=dict)
    """What is wrong by the name of each part that cannot be trusted."""


def inspect(parts: Path) -> Inspection:
    """Read and verify every part in a directory; none where there is no directory."""
    found = Inspection()
    digests = dict(read_digests(parts))
    for path in sorted(parts.glob("*.parquet")):
        try:
            table = verified(path, digests)
        except (OSError, ValueError, pa.ArrowException) as problem:
            found.damaged[path.name] = str(problem)
            continue
        if (reason := reason_of(table)) is not None:
            found.failed[path.name] = reason
        else:
            found.points += pc.count_distinct(table.column(POINT)).as_py()
    return found
