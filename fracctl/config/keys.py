"""The keys of a composed run, read off the YAML files alone: fast enough to complete words while somebody types.

Follows the defaults of the files and the choices of groups, as composing does, but checks nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from fracctl.config.catalogue import Catalogue

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_EXPERIMENT = "experiment"
_PRIMARY = "config"


def settings(found: Catalogue, words: Iterable[str]) -> dict[str, Any]:
    """Return the nested settings of the run that the words of a command line choose, as far as files say."""
    primary = _file(found, _PRIMARY)
    choices, experiment = dict(_choices(primary)), choices_of(found, words)
    named = experiment.pop(_EXPERIMENT, ())
    own = _experiment(found, named[0]) if named else {}
    choices |= dict(_choices(own)) | experiment
    composed: dict[str, Any] = {}
    for group, options in choices.items():
        for option in options if group in found.groups() else ():
            _merge(composed.setdefault(group, {}), _option(found, group, option))
    _merge(composed, primary)
    _merge(composed, own)
    composed.pop("defaults", None)
    return composed


def choices_of(found: Catalogue, words: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Return the options that words choose, by group; of a sweep, the first."""
    groups = found.groups()
    pairs = [word.partition("=")[::2] for word in words if "=" in word]
    return {group: _listed(value) for group, value in pairs if group in groups and value}


def _listed(value: str) -> tuple[str, ...]:
    inside = value.removeprefix("[").removesuffix("]").split(",")
    return tuple(inside) if value.startswith("[") else (inside[0],)


def dotted(nested: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the dotted keys of all values."""
    for name, value in nested.items():
        if isinstance(value, Mapping) and value:
            yield from dotted(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def _experiment(found: Catalogue, name: str) -> dict[str, Any]:
    """The settings of an experiment over those of the experiments that it names; its defaults hold the choices."""
    own = _file(found, f"{_EXPERIMENT}/{name}")
    merged: dict[str, Any] = {"defaults": []}
    for entry in own.get("defaults") or ():
        if isinstance(entry, str) and entry != "_self_":
            below = _experiment(found, entry.rpartition("/")[2])
            merged["defaults"] += below.pop("defaults", [])
            _merge(merged, below)
    merged["defaults"] += own.pop("defaults", None) or []
    _merge(merged, own)
    return merged


def _option(found: Catalogue, group: str, option: str) -> dict[str, Any]:
    """The settings of an option over those of the options of its group that it names."""
    own = _file(found, f"{group}/{option}")
    merged: dict[str, Any] = {}
    for entry in own.pop("defaults", None) or ():
        if isinstance(entry, str) and entry != "_self_":
            _merge(merged, _option(found, group, entry))
    _merge(merged, own)
    return merged


def _choices(content: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, ...]]]:
    for entry in content.get("defaults") or ():
        for key, value in entry.items() if isinstance(entry, Mapping) else ():
            group = str(key).removeprefix("override ").lstrip("/").partition("@")[0]
            names = value if isinstance(value, list) else [] if value is None else [value]
            yield group, tuple(map(str, names))


def _file(found: Catalogue, config_path: str) -> dict[str, Any]:
    path: Path | None = found.file(config_path)
    try:
        content = None if path is None else yaml.load(path.read_text(encoding="utf-8"), _LOADER)
    except (OSError, ValueError, yaml.YAMLError):
        content = None
    return content if isinstance(content, dict) else {}


def _merge(below: dict[str, Any], above: Mapping[str, Any]) -> None:
    for key, value in above.items():
        if isinstance(value, Mapping) and isinstance(below.get(key), dict):
            _merge(below[key], value)
        else:
            below[key] = dict(value) if isinstance(value, Mapping) else value
