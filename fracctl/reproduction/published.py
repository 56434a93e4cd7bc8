"""What a paper prints: the rows of ``published.csv``."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

from fracctl.errors import ConfigurationError, suggestion

REPRODUCED, NOT_REPRODUCED, NOT_DECIDABLE = WORDS = ("reproduced", "not_reproduced", "not_decidable")

UNITS: Mapping[str, float] = {
    "1": 1.0,
    "1e-3": 1e-3,
    "%": 0.01,
    "T_orb": 2.0 * math.pi,
    "km": 1.0,
    "1e-6 km": 1e-6,
    "1e-8 km": 1e-8,
    "m/s": 1.0,
    "orbits": 1.0,
    "percent": 1.0,
}
"""One unit of a printed number in that of its column: ``1e-3`` heads a column "× 10⁻³", T_orb is the chief's period; of
columns that hold a period or a per cent as 1, the unit is ``orbits`` or ``percent``."""

_COLUMNS = ("id", "place", "quantity", "unit", "published", "tolerance", "expected", "reason")
_PRINTED = re.compile(r"(?:([<>]) )?(-?\d+(?:\.\d+)?)")
_ID = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class Printed:
    """A printed number, or a claim that a number lies above or below another."""

    text: str
    """As it stands in the paper: ``2.0`` is not ``2``; a claim is written ``> 0`` or ``< 1``."""
    relation: str
    """``=``, ``<`` or ``>``."""
    number: Decimal

    @property
    def last_digit(self) -> Decimal:
        """One unit of the last printed digit."""
        exponent = self.number.as_tuple().exponent
        assert isinstance(exponent, int)
        return Decimal(1).scaleb(exponent)


@dataclass(frozen=True)
class PublishedRow:
    """One published number or claim."""

    id: str
    place: str
    """Where in the paper it stands."""
    quantity: str
    unit: str
    """A key of `UNITS`."""
    published: Printed
    tolerance: Decimal | None
    """Largest difference, in the row's unit; None for a claim."""
    expected: str
    """The verdict that is expected, one of `WORDS`."""
    reason: str
    """Why it is not reproduced or not decidable, or what to know where it is; may be empty if it is."""


def read_published(path: Path) -> tuple[PublishedRow, ...]:
    """Read a table of published numbers.

    Raises:
        ConfigurationError: the file is missing, or a row is not what it should be.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as problem:
        raise ConfigurationError(f"cannot read {path}: {problem.strerror}") from problem
    reader = csv.DictReader(lines, restkey="too many")
    if tuple(reader.fieldnames or ()) != _COLUMNS:
        raise ConfigurationError(f"{path}: its first line must be {','.join(_COLUMNS)}")
    rows = []
    for record in reader:
        where = f"{path}, line {reader.line_num}"
        rows.append(_row(record, where))
        if rows[-1].id in {row.id for row in rows[:-1]}:
            raise ConfigurationError(f"{where}: there is a second row '{rows[-1].id}'")
    return tuple(rows)


def _row(record: Mapping[str, str | None], where: str) -> PublishedRow:
    if "too many" in record or any(value is None for value in record.values()):
        raise ConfigurationError(f"{where}: must have {len(_COLUMNS)} columns; quote text that holds commas")
    given = {name: str(record[name]).strip() for name in _COLUMNS}
    if not _ID.fullmatch(given["id"]):
        raise ConfigurationError(f"{where}: id '{given['id']}' must consist of small letters, digits and '_'")
    _require_word(given, "unit", UNITS, where)
    _require_word(given, "expected", WORDS, where)
    if given["expected"] != REPRODUCED and not given["reason"]:
        raise ConfigurationError(f"{where}: '{given['expected']}' needs a reason")
    printed = _printed(given["published"], where)
    return PublishedRow(
        id=given["id"],
        place=given["place"],
        quantity=given["quantity"],
        unit=given["unit"],
        published=printed,
        tolerance=_tolerance(given["tolerance"], printed, where),
        expected=given["expected"],
        reason=given["reason"],
    )


def _require_word(given: Mapping[str, str], column: str, known: Iterable[str], where: str) -> None:
    word, words = given[column], list(known)
    if word not in words:
        hint = suggestion(word, words) or f"; one of {', '.join(words)}"
        raise ConfigurationError(f"{where}: there is no {column} '{word}'{hint}")


def _printed(text: str, where: str) -> Printed:
    match = _PRINTED.fullmatch(text)
    if match is None:
        raise ConfigurationError(f"{where}: published '{text}' must be a number, '> NUMBER' or '< NUMBER'")
    return Printed(text, match[1] or "=", Decimal(match[2]))


def _tolerance(text: str, printed: Printed, where: str) -> Decimal | None:
    if printed.relation != "=":
        if text:
            raise ConfigurationError(f"{where}: a claim has no tolerance")
        return None
    match = _PRINTED.fullmatch(text)
    if match is None or match[1] or Decimal(match[2]) < 0:
        raise ConfigurationError(f"{where}: tolerance '{text}' must be a number, at least 0")
    return Decimal(match[2])
