"""What the command line may set without effect: a misspelt entry of an open mapping, a controller beside laws."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

from fracctl.config.origins import Origins
from fracctl.config.overrides import Override, keys_of
from fracctl.errors import ConfigurationError, suggestion

_OPEN = ("initial_condition", "objectives", "figures", "evaluation.laws")
"""Mappings to which the command line may add entries."""
_NAMED_BY = {"evaluation.band_m": "initial_condition"}
"""Mappings whose entries have the names of another's."""
_TAKEN_AWAY = "evaluation.dispersions"
"""The mapping in which null takes away an entry of a file."""
_CONTROLLER = "controller"
_ALIKE = 0.75


def check_entries(overrides: Sequence[Override], origins: Origins, composed: Mapping[str, Any]) -> None:
    """Refuse a new entry that has nearly the name of one in a file, or whose name is that of nothing.

    Args:
        overrides: of keys, not of groups.
        origins: of what was composed.
        composed: the configuration, plain.

    Raises:
        ConfigurationError: there is one.
    """
    for override in overrides:
        for mapping, name, value in _entries(override):
            present = origins.entries(tuple(mapping.split(".")))
            if name in present:
                continue
            if mapping in _OPEN and (near := _meant(name, present)):
                cure = f"; did you mean '{mapping}.{near}'? A new entry needs a name less like it"
                raise ConfigurationError(f"unknown key '{mapping}.{name}'{cure}")
            if mapping in _NAMED_BY and name not in (known := composed.get(_NAMED_BY[mapping], {})):
                raise ConfigurationError(f"unknown key '{mapping}.{name}'{_hint(mapping, name, known)}")
            if mapping == _TAKEN_AWAY and value is None:
                raise ConfigurationError(f"{mapping}.{name} = null: takes nothing away{_hint(mapping, name, present)}")


def check_controller(overrides: Sequence[Override], laws: Collection[str]) -> None:
    """Refuse a controller where several laws have values of their own; one that a plant chosen with it needs may stand.

    Args:
        overrides: of groups and keys.
        laws: names of the evaluation's laws; none where the controller is the law.

    Raises:
        ConfigurationError: the command line sets one.
    """
    another_plant = any(override.key == "plant" for override in overrides)
    for override in overrides if laws else ():
        group, _, key = override.key.partition(".")
        if group != _CONTROLLER or override.deletes or (not key and another_plant):
            continue
        cure = f"set evaluation.laws.NAME.values.{key}" if key else "set keys of evaluation.laws.NAME"
        idle = f"plays no part, for the laws are those of evaluation.laws ({', '.join(laws)})"
        raise ConfigurationError(f"{override.text}: {idle}; {cure}")


def _entries(override: Override) -> Iterator[tuple[str, str, Any]]:
    """Yield the mapping, the entry's name and the value of each key in one of the mappings."""
    for key, value in keys_of(override.key, override.value):
        for mapping in (*_OPEN, *_NAMED_BY, _TAKEN_AWAY):
            if key.startswith(f"{mapping}.") and not override.deletes:
                yield mapping, key.removeprefix(f"{mapping}.").partition(".")[0], value


def _meant(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that another one misspells: not one that it extends, nor one with other digits."""
    strange = [other for other in known if not _deliberate(name, other)]
    return next(iter(difflib.get_close_matches(name, strange, n=1, cutoff=_ALIKE)), None)


def _deliberate(name: str, other: str) -> bool:
    same = _without_digits(name) == _without_digits(other)
    return same or name.startswith(other) or other.startswith(name)


def _without_digits(name: str) -> str:
    return "".join(letter for letter in name if not letter.isdigit())


def _hint(mapping: str, name: str, known: Iterable[str]) -> str:
    near = suggestion(name, known).replace("'", f"'{mapping}.", 1)
    return near or (f"; allowed: {', '.join(known)}" if known else "")
