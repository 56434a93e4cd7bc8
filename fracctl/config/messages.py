"""From the errors of a schema to sentences that name the key, its value and what is allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from fracctl.config.fields import Path
from fracctl.config.origins import Origin, Origins
from fracctl.errors import ConfigurationError, suggestion


class InvalidConfiguration(ConfigurationError):
    """A configuration with one or several errors."""

    def __init__(self, problems: Sequence[str]) -> None:
        self.problems = tuple(dict.fromkeys(problems))
        super().__init__("\n".join(self.problems))


_MOST_KEYS = 3
"""More keys than this are not listed in one sentence."""

_SENTENCES: Mapping[str, str] = {
    "missing": "is missing",
    "float_type": "must be a number",
    "finite_number": "must be a finite number",
    "int_type": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "dict_type": "must be a mapping",
    "model_type": "must be a mapping of options",
    "mapping_type": "must be a mapping",
    "list_type": "must be a list",
    "sequence_str": "must be a list",
    "too_short": "must not be empty",
    "greater_than": "must be above {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be below {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "literal_error": "must be {expected}",
}


def problems(error: ValidationError, origins: Origins | None = None) -> list[str]:
    """Return one sentence for each thing that is wrong; keys that do not fit a choice share a sentence."""
    sentences: list[str] = []
    strangers: dict[Origin, list[tuple[Path, Sequence[str]]]] = {}
    for line in error.errors(include_url=False):
        path = tuple(line["loc"])
        found = origins(path) if origins else None
        known = line.get("ctx", {}).get("known", ())
        if line["type"] != "unknown_key":
            sentences.append(_sentence(path, line) + ("" if found is None else _set_by(found, path)))
        elif found is None:
            written = origins.below(path) if origins else []
            sentences.append(_unknown(path, known, written=written[0] if written else dotted(path)))
        else:
            strangers.setdefault(found, []).append((path, known))
    for found, keys in strangers.items():
        clash = found.clash or (found.other if len(keys) > 1 else None)
        if clash is None:
            sentences += [_unknown(path, known, f" in {found.choice}") for path, known in keys]
        else:
            sentences.append(_clash([path for path, _ in keys], found, clash))
    return sentences


def dotted(path: Path) -> str:
    """``objectives.st_os_u`` for its path; ``[0]`` for the entry of a list."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return text.removeprefix(".")


def shown(value: Any) -> str:
    """A value as it would stand on the command line, shortened where it is long."""
    names: dict[Any, str] = {None: "null", True: "true", False: "false"}
    if value is None or isinstance(value, bool):
        return names[value]
    if isinstance(value, float):
        text = f"{value:.12g}"
    elif isinstance(value, list):
        text = f"[{', '.join(shown(entry) for entry in value)}]"
    else:
        text = "{…}" if isinstance(value, Mapping) else str(value) or "''"
    return text if len(text) <= 60 else text[:59] + "…"


def _unknown(path: Path, known: Sequence[str], where: str = "", written: str | None = None) -> str:
    key, parent = str(path[-1]), path[:-1]
    near = suggestion(key, known)
    hint = near.replace("'", f"'{dotted(parent)}.", 1) if near and parent else near
    if not hint and known:
        hint = f"; allowed: {', '.join(known)}"
    return f"unknown key '{written or dotted(path)}'{where}{hint}"


def _sentence(path: Path, line: Mapping[str, Any]) -> str:
    kind, value = line["type"], line["input"]
    text = _SENTENCES[kind].format(**line.get("ctx", {})) if kind in _SENTENCES else line["msg"]
    name = dotted(path) or "configuration"
    if kind == "missing":
        return f"{name} is missing"
    if kind == "sentence":
        return f"{name}: {text}"
    return f"{name} = {shown(value)}: {text}"


def _set_by(found: Origin, path: Path) -> str:
    cure = "; choose others with figures=NAME, or figures=null" if path[:1] == ("figures",) else ""
    return f" (set by {found.choice}{cure})"


def _clash(paths: Sequence[Path], found: Origin, clash: str) -> str:
    """Keys that an experiment or another option set, and that the law or plant chosen does not have."""
    one = len(paths) == 1
    shown_keys = ", ".join(f"'{dotted(path)}'" for path in paths[:_MOST_KEYS]) + (", …" * (len(paths) > _MOST_KEYS))
    fit = f"{'does' if one else 'do'} not fit {clash}, but {'is' if one else 'are'} set by {found.choice}"
    group = str(paths[0][0])
    cure = f"choose another {group.replace('_', ' ')} ('fracctl list {group}')"
    if len(paths) <= _MOST_KEYS:
        removed = " ".join(f"'~{dotted(path)}'" for path in paths)
        cure += f", or remove {'it' if one else 'them'} with {removed}"
    return f"{'key' if one else 'keys'} {shown_keys} {fit}; {cure}"
