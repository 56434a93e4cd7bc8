"""`fracctl.run`: an experiment by name, from Python."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

from fracctl.config.command import Command
from fracctl.config.compose import compose
from fracctl.config.studies import study_file
from fracctl.errors import ArgumentError, IncompleteRunWarning
from fracctl.execution.run import RunResult, execute


def run(experiment: str, overrides: Sequence[str] = (), *, config_dir: str | Path | None = None) -> RunResult:
    """Run an experiment as the command line does; in this process unless `overrides` name a scheduler.

    Args:
        experiment: name, e.g. ``ic1_outofplane``, or file of a study, e.g. ``my_study.yaml``.
        overrides: as on the command line, e.g. ``["survey.axes.alpha_w=[0.91,1.0]"]``; here a key may stand twice, and
            the last one counts.
        config_dir: a directory of your own configuration files.

    Warns:
        IncompleteRunWarning: points are missing, or a check of the result failed; `RunResult.status` says so too.

    Raises:
        ArgumentError: `overrides` is one text.
        ConfigurationError: a key is unknown or a value out of range.
        RunError: the run could not be computed or stored.
    """
    if isinstance(overrides, str):
        raise ArgumentError("overrides", overrides, "must be a list of words", f"write ['{overrides}']")
    chosen = any(word.lstrip("+").startswith(("scheduler=", "scheduler@")) for word in overrides)
    default = [] if chosen else ["scheduler=serial"]
    chosen_run = experiment if study_file(experiment) else f"experiment={experiment}"
    arguments = [chosen_run, *default, *overrides]
    directory = None if config_dir is None else Path(config_dir)
    result = execute(compose(arguments, directory), command=Command.of(arguments, directory))
    if error := result.summary.get("error"):
        warnings.warn(f"{experiment}: {error}", IncompleteRunWarning, stacklevel=2)
    return result
