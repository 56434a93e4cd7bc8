"""A run in a file of one's own: `fracctl run my_study` takes ``my_study.yaml`` as an experiment."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from fracctl.config.catalogue import catalogue
from fracctl.errors import UsageError

ENDING = ".yaml"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_ALLOWED = "the name of a study begins with a letter and has letters, digits, '_' and '-' only"


def study_file(word: str) -> Path | None:
    """The file that a word without ``=`` names, with or without its ending; None if there is none.

    Raises:
        UsageError: the file has a name that cannot stand for an experiment.
    """
    if not may_be_study(word):
        return None
    path = Path(word if word.endswith(ENDING) else f"{word}{ENDING}")
    if not path.is_file():
        return None
    if not _NAME.fullmatch(path.stem):
        raise UsageError(f"'{path.name}': {_ALLOWED}; rename the file")
    return path.absolute()


def may_be_study(word: str) -> bool:
    """Whether a word is no override."""
    return "=" not in word and not word.startswith("~")


def new_study(word: str) -> Path:
    """The file for a new study.

    Raises:
        UsageError: the name cannot stand for an experiment, or there is one of this name.
    """
    path = Path(f"{word.removesuffix(ENDING)}{ENDING}")
    if not _NAME.fullmatch(path.stem):
        raise UsageError(f"'{word}': {_ALLOWED}")
    if path.stem in catalogue().options("experiment"):
        raise UsageError(f"'{path.stem}' is the name of an experiment that there is already; choose another")
    return path


def with_study(words: Sequence[str]) -> tuple[list[str], Path | None]:
    """Return the words with ``experiment=NAME`` in place of the study, and its file.

    Raises:
        UsageError: there are two.
    """
    files = {word: file for word in words if (file := study_file(word)) is not None}
    if len(files) > 1:
        named = " and ".join(f"'{word}'" for word in files)
        raise UsageError(f"a run has one study, not {named}; 'fracctl compare' puts several beside each other")
    overrides = [f"experiment={files[word].stem}" if word in files else word for word in words]
    return overrides, next(iter(files.values()), None)


def studies_here() -> list[str]:
    """Names of the files in the current directory that may be studies."""
    return sorted(path.stem for path in Path().glob(f"*{ENDING}"))
