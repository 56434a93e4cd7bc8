"""What may stand on the command line: choices of groups, and keys; everything Hydra would take silently is refused."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fracctl.config.catalogue import SEVERAL_ALLOWED, Catalogue
from fracctl.errors import ConfigurationError, UsageError, suggestion

_EMPTY_ALLOWED = SEVERAL_ALLOWED | {"experiment"}


@dataclass(frozen=True)
class Override:
    """One parsed word of the command line, ``key=value`` or ``~key``."""

    text: str
    """As it was written."""
    key: str
    """A group, or a dotted key."""
    value: Any = None
    """Parsed; None where it is a sweep."""
    sweep: tuple[str, ...] | None = None
    """Values of a sweep, as they would be written one by one."""
    deletes: bool = False
    """Whether it reads ``~key``."""
    package: str | None = None
    """What follows @ in the key."""

    @property
    def written_value(self) -> str:
        """What follows the first equals sign."""
        return self.text.partition("=")[2]


def check(overrides: Sequence[Override], catalogue: Catalogue) -> None:
    """Refuse what composes but means nothing, or not what it says.

    Raises:
        UsageError: a sweep without -m, a key that is none, or a key to be removed that has a value.
        ConfigurationError: an unknown option, a group chosen twice, Hydra's own settings.
    """
    groups = catalogue.groups()
    chosen: dict[str, Override] = {}
    for override in overrides:
        _check_key(override, groups)
        if override.key in groups:
            if override.key in chosen:
                _refuse_second(chosen[override.key], override)
            chosen[override.key] = override
        if override.sweep is not None:
            _refuse_sweep(override, groups)
        if override.key in groups:
            for option in options_of(override):
                catalogue.require(override.key, option)


def check_once(words: Sequence[str], groups: Sequence[str]) -> None:
    """Refuse a key that two words of a command line set, of which Hydra would take the last; `check` refuses groups.

    Raises:
        ConfigurationError: there is one.
    """
    given: dict[str, str] = {}
    for word in words:
        key, equals, value = word.lstrip("~+").partition("=")
        if key in groups or not (equals or word.startswith("~")):
            continue
        if key in given:
            first = given[key]
            both = f"{first.partition('=')[2]},{value}"
            removes = word.startswith("~") or first.startswith("~")
            each = "" if removes else f"; for a run with each, write -m {key}={both}"
            raise ConfigurationError(f"{key} is set twice, '{first}' and '{word}'; keep one of them{each}")
        given[key] = word


def keys_of(key: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the keys that a word sets, with their values: those of a mapping one by one."""
    if isinstance(value, Mapping) and value:
        for name, entry in value.items():
            yield from keys_of(f"{key}.{name}", entry)
    else:
        yield key, value


def options_of(override: Override) -> tuple[str, ...]:
    """The options that a choice of a group names.

    Raises:
        ConfigurationError: the group cannot be removed, emptied, or take several.
    """
    group, value = override.key, override.value
    if override.deletes or (value is None and group not in _EMPTY_ALLOWED):
        cure = f"write {group}=null" if group in _EMPTY_ALLOWED else f"choose another with {group}=NAME"
        raise ConfigurationError(f"'{override.text}' would leave the run without its {_words(group)}; {cure}")
    if value is None:
        return ()
    if isinstance(value, list):
        if group not in SEVERAL_ALLOWED:
            each = ",".join(str(entry) for entry in value)
            raise ConfigurationError(
                f"'{override.text}': a run has one {_words(group)}; for a run with each, write -m {group}={each}"
            )
        return tuple(str(entry) for entry in value)
    if isinstance(value, dict | bool) or value == "":
        names = f"{group} takes the name of an option ('fracctl list {group}')"
        raise ConfigurationError(f"'{override.text}': {names}; set keys as {group}.KEY=VALUE")
    return (str(value),)


def for_hydra(override: Override, groups: Sequence[str]) -> str:
    """The word that Hydra is given: keys may be new, because the schema decides whether they exist."""
    if override.key not in groups:
        return f"~{override.key}" if override.deletes else f"++{override.key}={override.written_value}"
    options = options_of(override)
    if override.key == "experiment":
        return f"experiment@_global_={options[0] if options else 'null'}"
    listed = f"[{','.join(options)}]" if override.key in SEVERAL_ALLOWED else options[0]
    return f"{override.key}={listed}"


def _check_key(override: Override, groups: Sequence[str]) -> None:
    key, text = override.key, override.text
    if not key:
        raise UsageError(f"'{text}' is not an override; write KEY=VALUE")
    if key.split(".")[0].split("/")[0] == "hydra":
        raise ConfigurationError(
            f"'{text}': Hydra's own settings have no effect here; runs are stored below output_dir=DIR"
        )
    if override.deletes and key not in groups and "=" in text:
        raise UsageError(f"'{text}': a key is removed whatever its value; write '~{key}', or '{text[1:]}' to set it")
    if override.package is not None:
        raise ConfigurationError(f"'{text}': '@' has no meaning here; write {key}=NAME")
    if "/" in key and key not in groups:
        raise ConfigurationError(f"there is no group '{key}'{suggestion(key.split('/')[0], groups)}")


def _refuse_second(first: Override, second: Override) -> None:
    group = first.key
    one, other = first.written_value, second.written_value
    both = f"[{one.strip('[]')},{other.strip('[]')}]"
    cure = f"for both in one run, write {group}={both}; " if group in SEVERAL_ALLOWED else ""
    raise ConfigurationError(
        f"{_words(group)} is chosen twice, '{first.text}' and '{second.text}'; {cure}for a run with each, write "
        f"-m {group}={one},{other}"
    )


def _refuse_sweep(override: Override, groups: Sequence[str]) -> None:
    key, value = override.key, override.written_value
    cure = ""
    if key.startswith("survey.axes.") and value.startswith("range("):
        cure = "; an axis of a survey is written start:stop:step"
    elif key in SEVERAL_ALLOWED or key not in groups:
        cure = f"; a list is written '{key}=[{value}]'"
    raise UsageError(f"'{override.text}' names several runs; add -m to run them all{cure}")


def _words(group: str) -> str:
    return group.replace("_", " ")
