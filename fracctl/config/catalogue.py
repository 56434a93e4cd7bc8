"""Where the YAML files are, and what they offer; reads the file system only."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

from fracctl.config.registry import entry_points, load_entry_point
from fracctl.errors import ConfigurationError, suggestion

SEVERAL_ALLOWED = frozenset({"initial_condition", "figures"})
"""Groups of which a run may take several options, or (figures) none."""

OWN_DIRECTORY = "FRACCTL_CONFIG_DIR"
"""Environment variable with the user's directory, where the command line names none."""

_PACKAGE = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Catalogue:
    """Groups and their options in one or several directories; a file in an earlier directory hides later ones."""

    directories: tuple[Path, ...]
    study: Path | None = None
    """A file that stands for the experiment of its name."""

    def groups(self) -> tuple[str, ...]:
        """Names of all groups, sorted."""
        found = {path.name for directory in self.directories for path in directory.iterdir() if path.is_dir()}
        return tuple(sorted(name for name in found if self.options(name)))

    def options(self, group: str) -> tuple[str, ...]:
        """Names of a group's options, sorted; those in a subdirectory read ``folder/name``."""
        roots = [directory / group for directory in self.directories]
        found = {path.relative_to(root).with_suffix("").as_posix() for root in roots for path in root.rglob("*.yaml")}
        own = {self.study.stem} if self.study is not None and group == "experiment" else set()
        return tuple(sorted(found | own))

    def file(self, config_path: str) -> Path | None:
        """The file of e.g. ``plant/hcw``, None if there is none."""
        if self.study is not None and config_path == f"experiment/{self.study.stem}":
            return self.study
        candidates = (directory / f"{config_path}.yaml" for directory in self.directories)
        return next((path for path in candidates if path.is_file()), None)

    def summary(self, group: str, option: str) -> str:
        """What the comment at the head of a file says; for an experiment, without the command that runs it."""
        path = self.file(f"{group}/{option}")
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines() if path else []
        comment = []
        for line in lines:
            if not line.startswith("#"):
                break
            if not line.lstrip("# ").startswith(("fracctl ", "@")):
                comment.append(line.lstrip("# ").strip())
        return " ".join(comment)

    def require(self, group: str, option: str) -> None:
        """Raise ConfigurationError unless the group has this option."""
        options = self.options(group)
        if option not in options:
            hint = suggestion(option, options) or f"; 'fracctl list {_listed(group)}' names all"
            raise ConfigurationError(f"there is no {group.replace('_', ' ')} '{option}'{hint}")


def catalogue(config_dir: Path | None = None, study: Path | None = None) -> Catalogue:
    """The user's study and directory, if any, the built-in one, and those of installed extensions, in this order.

    Raises:
        ConfigurationError: a directory does not exist, or the study has the name of an experiment.
    """
    own = own_directory(config_dir)
    found = Catalogue((*([] if own is None else [own]), built_in_directory(), *_extensions()))
    if study is None:
        return found
    if study.stem in found.options("experiment"):
        raise ConfigurationError(f"'{study.name}' has the name of an experiment that there is already; rename the file")
    return replace(found, study=study)


def own_directory(config_dir: Path | None = None) -> Path | None:
    """The user's directory, absolute: the one given, or that of the environment; None if there is none.

    Raises:
        ConfigurationError: it does not exist.
    """
    if config_dir is None and os.environ.get(OWN_DIRECTORY):
        config_dir = Path(os.environ[OWN_DIRECTORY])
    return None if config_dir is None else _existing(config_dir)


def built_in_directory() -> Path:
    """``fracctl/conf`` of an installed wheel, else ``conf`` of the checkout."""
    packaged = _PACKAGE / "conf"
    return packaged if packaged.is_dir() else _existing(_PACKAGE.parent / "conf")


def _existing(directory: Path) -> Path:
    if not directory.is_dir():
        what = "is not a directory" if directory.exists() else "does not exist"
        raise ConfigurationError(f"the configuration directory '{directory}' {what}")
    return directory.resolve()


def _extensions() -> list[Path]:
    """Directories behind the entry points `fracctl.conf`: a path, or a package that holds the YAML files."""
    found = []
    for name in sorted(entry_points("conf")):
        target = load_entry_point("conf", name)
        found.append(_existing(Path(target if isinstance(target, str | Path) else Path(target.__file__).parent)))
    return found


def _listed(group: str) -> str:
    return "experiments" if group == "experiment" else group
