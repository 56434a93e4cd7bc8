"""The command that started a run, as it is stored with it."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Sequence
from pathlib import Path

from fracctl.config.catalogue import own_directory
from fracctl.config.compose import compose
from fracctl.config.fields import Strict
from fracctl.config.schemas import RunConfig
from fracctl.config.studies import may_be_study, with_study

_LEFT_OUT = ("scheduler", "output_dir")
"""Where a run is computed and stored is no part of it."""


class Command(Strict):
    """What stood behind ``fracctl run``, and the files of one's own that it led to."""

    words: list[str]
    """A study and overrides, as they were given."""
    config_dir: str | None = None
    """The directory of one's own YAML files, absolute."""
    study: str | None = None
    """The file of the study, absolute."""
    study_sha256: str | None = None
    """What it was."""

    @classmethod
    def of(cls, words: Sequence[str], config_dir: Path | None = None) -> Command:
        """Return the command of words that compose here and now."""
        own, (_, study) = own_directory(config_dir), with_study(words)
        return cls(
            words=list(words),
            config_dir=None if own is None else str(own),
            study=None if study is None else str(study),
            study_sha256=None if study is None else _digest(study),
        )

    @property
    def line(self) -> str:
        """The command for a shell, without where the run is computed and stored."""
        place = [] if self.config_dir is None else ["--config-dir", self.config_dir]
        words = [word for word in self.words if _root(word) not in _LEFT_OUT]
        return shlex.join(["fracctl", "run", *place, *words])

    @property
    def lost(self) -> str | None:
        """Why the study is not the one of the run any more, in half a sentence; None where it is."""
        if self.study is None:
            return None
        if not Path(self.study).is_file():
            return f"{self.study} is not there any more"
        return f"{self.study} has changed since" if _digest(Path(self.study)) != self.study_sha256 else None

    def compose(self) -> RunConfig:
        """Return the configuration that the words lead to now, wherever it is asked for.

        Raises:
            UsageError, ConfigurationError: as `fracctl.config.compose.compose`.
        """
        words = [str(self.study) if may_be_study(word) else word for word in self.words]
        return compose(words, None if self.config_dir is None else Path(self.config_dir))


def _root(word: str) -> str:
    """``scheduler`` of ``+scheduler.workers=2``."""
    return word.lstrip("+~").partition("=")[0].partition(".")[0].partition("@")[0]


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
