"""The overrides that compose to a given configuration, found from its differences to an experiment."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from fracctl.config.catalogue import SEVERAL_ALLOWED, Catalogue, catalogue
from fracctl.config.compose import compose, compose_plain
from fracctl.config.schemas import RunConfig
from fracctl.errors import FracctlError

_LEFT_OUT = ("scheduler", "output_dir")
"""Where a run is computed and stored is no part of it."""
_PLAIN = re.compile(r"[A-Za-z_][\w./+-]*|[\d.+-]+(:[\d.+-]+)+")
"""Text that needs no quotes in an override: words and axes."""
_RESERVED = ("null", "true", "false", "nan", "inf")
_Keys = tuple[str, ...]


def overrides_for(config: RunConfig, config_dir: Path | None = None) -> tuple[str, ...] | None:
    """Return words that compose to a configuration: its experiment, other options of groups, then single keys.

    Args:
        config: as it shall come out.
        config_dir: a further directory of YAML files.

    Returns:
        The words; None where none are found: a key that is no word cannot be set by an override.
    """
    found = catalogue(config_dir)
    wanted = config.model_dump(mode="json")
    base = _experiment(found, wanted["name"])
    try:
        chosen = base + _choices(found, compose_plain(base, config_dir), wanted)
        for words in dict.fromkeys([tuple(chosen), tuple(base)]):
            completed = _completed(words, wanted, config_dir)
            if _comes_out(completed, wanted, config_dir):
                return completed
    except FracctlError:
        return None
    return None


def _experiment(found: Catalogue, name: str) -> list[str]:
    """The experiment whose runs bear the name; none for a run of one's own."""
    options = found.options("experiment")
    by_name = (option for option in options if _contents(found, "experiment", option).get("name") == name)
    option = name if name in options else next(by_name, None)
    return [] if option is None else [f"experiment={option}"]


def _choices(found: Catalogue, present: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Choices of groups that are nearer to what is wanted than what the experiment chooses."""
    words = []
    for group in found.groups():
        if group not in wanted or group in _LEFT_OUT:
            continue
        have, want = present.get(group, {}), wanted[group]
        if not _wrong(have, want) and ("type" in want or set(have) == set(want)):
            continue
        options = {option: _contents(found, group, option) for option in found.options(group)}
        names = _several(options, want) if group in SEVERAL_ALLOWED else _nearest(options, want)
        if not names:
            continue
        merged: dict[str, Any] = {}
        for name in names:
            merged = _merged(merged, options[name])
        gain = _differences(have, want) - _differences(merged, want)
        if gain > 1 or (gain and _wrong(_type(have), _type(merged))):
            words.append(f"{group}=[{','.join(names)}]" if len(names) > 1 else f"{group}={names[0]}")
    return words


def _type(part: Mapping[str, Any]) -> Any:
    return part.get("type")


def _nearest(options: Mapping[str, Any], want: Any) -> list[str]:
    return [min(options, key=lambda name: _differences(options[name], want))]


def _several(options: Mapping[str, Any], want: Mapping[str, Any]) -> list[str]:
    """Options that hold the wanted entries, each once; empty where an entry is in none."""
    chosen: list[str] = []
    missing = list(want)
    while missing:
        able = [name for name, content in options.items() if missing[0] in content and set(content) <= set(missing)]
        if not able:
            return []
        nearest = min(able, key=lambda name: (_wrong(options[name], want), -len(options[name])))
        chosen.append(nearest)
        missing = [name for name in missing if name not in options[nearest]]
    return chosen


def _completed(words: Sequence[str], wanted: Mapping[str, Any], config_dir: Path | None) -> tuple[str, ...]:
    """The words and what else they need: keys removed, then keys set."""
    plain = compose_plain(words, config_dir)
    removed = [f"~{'.'.join(keys)}" for keys in _superfluous(plain, wanted)]
    try:
        present = compose([*words, *removed], config_dir).model_dump(mode="json")
    except FracctlError:  # they do not fit each other before the keys are set
        every = (*words, *removed, *_set(compose_plain([*words, *removed], config_dir), wanted))
        return _without_defaults(every, wanted, config_dir)
    return (*words, *removed, *_set(present, wanted))


def _set(present: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    return [f"{'.'.join(keys)}={_written(value)}" for keys, value in _changed(present, wanted)]


def _without_defaults(words: tuple[str, ...], wanted: Mapping[str, Any], config_dir: Path | None) -> tuple[str, ...]:
    """Leave out the words that change nothing."""
    for word in reversed(words):
        fewer = tuple(other for other in words if other != word)
        if _comes_out(fewer, wanted, config_dir):
            words = fewer
    return words


def _comes_out(words: Sequence[str], wanted: Mapping[str, Any], config_dir: Path | None) -> bool:
    """Whether words compose to what is wanted."""
    try:
        found = compose(words, config_dir).model_dump(mode="json")
    except FracctlError:
        return False
    return all(found[key] == value for key, value in wanted.items() if key not in _LEFT_OUT)


def _superfluous(have: Mapping[str, Any], want: Mapping[str, Any], above: _Keys = ()) -> Iterator[_Keys]:
    for key, value in have.items():
        if above == () and key in _LEFT_OUT:
            continue
        if key not in want:
            yield (*above, key)
        elif isinstance(value, Mapping) and isinstance(want[key], Mapping):
            yield from _superfluous(value, want[key], (*above, key))


def _changed(have: Mapping[str, Any], want: Mapping[str, Any], above: _Keys = ()) -> Iterator[tuple[_Keys, Any]]:
    for key, value in want.items():
        if (above == () and key in _LEFT_OUT) or (key in have and have[key] == value):
            continue
        nested = have.get(key, {})
        if isinstance(value, Mapping) and value and isinstance(nested, Mapping):
            yield from _changed(nested, value, (*above, key))
        else:
            yield (*above, key), value


def _differences(have: Any, want: Any) -> int:
    """Number of values that are in one of two nested mappings only, or differ."""
    if not isinstance(have, Mapping) or not isinstance(want, Mapping):
        return 0 if have == want else _size(want)
    return sum(_size(value) for key, value in have.items() if key not in want) + sum(
        _differences(have[key], value) if key in have else _size(value) for key, value in want.items()
    )


def _wrong(have: Any, want: Any) -> int:
    """Number of values of a nested mapping that another does not have; it may have more."""
    if isinstance(have, Mapping) and isinstance(want, Mapping):
        return sum(_wrong(value, want.get(key)) for key, value in have.items())
    return int(have != want)


def _size(value: Any) -> int:
    return max(1, sum(map(_size, value.values()))) if isinstance(value, Mapping) else 1


def _contents(found: Catalogue, group: str, option: str) -> dict[str, Any]:
    """Return what a file and the files of its group that it includes say."""
    path = found.file(f"{group}/{option}")
    own = yaml.safe_load(path.read_text(encoding="utf-8")) if path else None
    if not isinstance(own, dict):
        return {}
    content: dict[str, Any] = {}
    for entry in own.pop("defaults", None) or ():
        if isinstance(entry, str) and entry != "_self_":
            content = _merged(content, _contents(found, group, entry))
    return _merged(content, own)


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    both = {key: (below[key], above[key]) for key in below if key in above}
    nested = {key: _merged(one, other) for key, (one, other) in both.items() if _mappings(one, other)}
    return {**below, **above, **nested}


def _mappings(one: Any, other: Any) -> bool:
    return isinstance(one, Mapping) and isinstance(other, Mapping)


def _written(value: Any) -> str:
    """Return a value in the grammar of overrides."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, Mapping):
        return "{" + ",".join(f"{_written(key)}:{_written(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return f"[{','.join(map(_written, value))}]"
    if isinstance(value, str) and (not _PLAIN.fullmatch(value) or value.lower() in _RESERVED):
        escaped = value.replace("\\", "\\\\").replace("'", "\\'")
        return f"'{escaped}'"
    return str(value)
