"""Who set a key: the command line, a group's option, or an experiment; messages must blame the right one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import yaml

from fracctl.config.catalogue import SEVERAL_ALLOWED, Catalogue
from fracctl.config.fields import Path

_DETERMINED_BY: Mapping[str, tuple[str, ...]] = {
    "controller": ("controller", "plant"),
    "initial_condition": ("plant",),
    "survey": ("controller", "plant"),
    "objectives": ("measures",),
    "constraints": ("measures",),
    "figures": ("initial_condition",),
}
"""Groups that decide which keys another group may have."""


@dataclass(frozen=True)
class Origin:
    """The file that set a key."""

    choice: str
    """``experiment=mine``, with the experiment that chose it where that is not the command line."""
    clash: str | None = None
    """The choice on the command line that the key may not fit, e.g. ``controller=pd``."""
    other: str | None = None
    """The choice made elsewhere that the key may not fit."""


@dataclass(frozen=True)
class Origins:
    """The files of a composition, and what the command line chose."""

    catalogue: Catalogue
    files: Sequence[tuple[str, str]]
    """``experiment/mine`` and the package its keys go to, in the order in which they are merged."""
    groups: Mapping[str, str]
    """Choices on the command line: group to ``group=option``."""
    keys: Sequence[str]
    """Dotted keys set on the command line."""

    def __call__(self, path: Path) -> Origin | None:
        """The origin of a key, None for the command line or an unknown one."""
        dotted = ".".join(str(key) for key in path)
        if any(f"{dotted}.".startswith(f"{key}.") for key in self.keys) or self.below(path):
            return None
        for config_path, package in reversed(self.files):
            below = path[len(package.split(".")) :] if package else path
            matches = not package or dotted.startswith(f"{package}.")
            if matches and _holds(self._contents[config_path], below):
                return self._origin(config_path, str(path[0]))
        return None

    def below(self, path: Path) -> list[str]:
        """The keys on the command line that lie below a path."""
        dotted = ".".join(str(key) for key in path)
        return [key for key in self.keys if key.startswith(f"{dotted}.")]

    def entries(self, path: Path) -> list[str]:
        """Names of the entries that files give to a mapping."""
        found: dict[str, None] = {}
        for config_path, package in self.files:
            above = tuple(package.split(".")) if package else ()
            inside: Any = self._contents[config_path] if path[: len(above)] == above else None
            for key in path[len(above) :]:
                inside = inside.get(str(key)) if isinstance(inside, dict) else None
            found |= dict.fromkeys(inside if isinstance(inside, dict) else ())
        return [name for name in found if name != "defaults"]

    @cached_property
    def _contents(self) -> dict[str, Any]:
        found = {}
        for config_path, _ in self.files:
            file = self.catalogue.file(config_path)
            found[config_path] = yaml.load(file.read_text(encoding="utf-8"), yaml.BaseLoader) if file else None
        return found

    def _origin(self, config_path: str, group: str) -> Origin:
        choice = self._top(config_path)
        deciding = [name for name in _DETERMINED_BY.get(group, ()) if self._chosen(name) not in (None, choice)]
        clash = next((self.groups[name] for name in deciding if name in self.groups), None)
        other = next((self._chosen(name) for name in deciding), None)
        return Origin(choice + self._through(config_path), clash, other)

    def _top(self, config_path: str) -> str:
        """The choice that brought a file in; an option may include others of its group."""
        group = config_path.partition("/")[0]
        return (self._chosen(group) if group not in SEVERAL_ALLOWED else None) or _choice(config_path)

    def _chosen(self, group: str) -> str | None:
        options = [path.partition("/")[2] for path, _ in self.files if path.startswith(f"{group}/")]
        return f"{group}={options[-1]}" if options else None

    def _through(self, config_path: str) -> str:
        group = config_path.partition("/")[0]
        if group in self.groups:
            return ""
        for path, contents in self._contents.items():
            defaults = contents.get("defaults", []) if isinstance(contents, dict) else []
            if any(isinstance(entry, dict) and f"override /{group}" in entry for entry in defaults):
                return f", which {_choice(path)} chooses"
        return ""


def _choice(config_path: str) -> str:
    group, _, option = config_path.partition("/")
    return f"{group}={option}" if option else f"{config_path}.yaml"


def _holds(contents: Any, path: Path) -> bool:
    for key in path:
        if not isinstance(contents, dict) or str(key) not in contents:
            return isinstance(contents, list) and isinstance(key, int)
        contents = contents[str(key)]
    return bool(path)
