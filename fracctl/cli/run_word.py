"""Words of a command line that may name a stored run or a study."""

from __future__ import annotations

from pathlib import Path

from fracctl.config.studies import study_file


def names_run(word: str) -> bool:
    """Whether a word names a directory and not a study; it then is one of a run, or to be refused.

    A directory that holds no run does not hide the study of its name.
    """
    path = Path(word)
    if "=" in word or not path.is_dir():
        return False
    return (path / "run.json").is_file() or study_file(word) is None
