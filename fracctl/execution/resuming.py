"""Continuing a stored run from its own record, wherever its directory lies by now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fracctl.config.compose import compose
from fracctl.config.schemas import RunConfig
from fracctl.errors import RunError, UsageError
from fracctl.store import RunDirectory
from fracctl.store.identity import run_id
from fracctl.store.provenance import differences

_SCHEDULER = "scheduler"


def continuation(directory: RunDirectory, overrides: Sequence[str] = ()) -> RunConfig:
    """Return the configuration with which the present program continues an unfinished run.

    Args:
        directory: of the run; it may have been moved or renamed.
        overrides: of the scheduler, which changes no number; all else is as stored.

    Raises:
        UsageError: an override is not of the scheduler.
        ConfigurationError: an override of the scheduler is wrong.
        RunError: there is no run, or the present program would compute another one.
    """
    configuration = directory.configuration
    for word in overrides:
        if word.lstrip("+~").partition("=")[0].partition(".")[0] != _SCHEDULER:
            raise UsageError(f"'resume' takes keys of the scheduler only, not '{word}'; all else is as run.json says")
    if reason := obstacle(directory):
        raise RunError(f"{directory.path} cannot be continued: {reason}")
    if overrides:
        configuration = {**configuration, _SCHEDULER: _scheduler(configuration[_SCHEDULER], overrides)}
    return RunConfig.model_validate(configuration)


def obstacle(directory: RunDirectory) -> str | None:
    """Return why the present program cannot continue a run, in a sentence with the cure; None if it can.

    Raises:
        RunError: there is no run.
    """
    content = directory.run_json
    begun, now = str(content.get("run_id", directory.path.name)), run_id(directory.configuration)
    if begun == now:
        return None
    if changes := differences(content.get("provenance", {})):
        cure = "go back to those, or begin it anew by 'fracctl run'"
        return f"it was begun with {'; '.join(changes)}, so its id would be {now}, not {begun}; {cure}"
    cure = "put the configuration back, or begin it anew by 'fracctl run'"
    return f"the configuration in run.json is not the one it was begun with (id {now}, not {begun}); {cure}"


def _scheduler(given: Mapping[str, Any], overrides: Sequence[str]) -> dict[str, Any]:
    """The stored scheduler with some keys changed, or another one."""
    keys = [word.lstrip("+~").partition("=")[0].partition(".")[2] for word in overrides]
    if "" in keys:
        return compose(overrides).scheduler.model_dump(mode="json")
    composed = compose([f"{_SCHEDULER}={given['type']}", *overrides]).scheduler.model_dump(mode="json")
    changed = {key.partition(".")[0] for key in keys}
    return {**given, **{key: value for key, value in composed.items() if key in changed}}
