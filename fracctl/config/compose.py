"""From words of the command line to a configuration. The only file that knows Hydra, OmegaConf, and their internals."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml
from hydra import compose as hydra_compose
from hydra import version
from hydra._internal.config_search_path_impl import ConfigSearchPathImpl
from hydra._internal.hydra import Hydra
from hydra.core.config_loader import ConfigLoader
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override as HydraOverride
from hydra.core.override_parser.types import Transformer, ValueType
from hydra.core.plugins import Plugins
from hydra.core.singleton import Singleton
from hydra.core.utils import JobRuntime
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import InterpolationResolutionError, MissingMandatoryValue
from pydantic import ValidationError

from fracctl.config.catalogue import Catalogue, catalogue
from fracctl.config.entries import check_controller, check_entries
from fracctl.config.messages import InvalidConfiguration, problems
from fracctl.config.origins import Origins
from fracctl.config.overrides import Override, check, for_hydra
from fracctl.config.schemas import RunConfig
from fracctl.config.studies import studies_here, study_file, with_study
from fracctl.config.yaml_traps import traps
from fracctl.errors import ConfigurationError, UsageError, suggestion

MOST_JOBS = 10_000
"""More runs than this on one command line are a survey written as a sweep."""

_PRIMARY = "config"
_QUOTED = re.compile(r"'[^']*'")


def compose(overrides: Sequence[str], config_dir: Path | None = None) -> RunConfig:
    """Compose and validate one run.

    Args:
        overrides: ``group=option``, ``key=value`` or ``~key``; the grammar is Hydra's. A word without ``=`` names a
            file that stands for the experiment.
        config_dir: a further directory of YAML files; they win over built-in ones of the same name.

    Raises:
        UsageError: a word is no override, or names several runs.
        ConfigurationError: the configuration is wrong; an InvalidConfiguration lists everything that is.
    """
    data, origins, parsed = _composed(overrides, config_dir)
    try:
        config = RunConfig.model_validate(data)
    except ValidationError as error:
        raise InvalidConfiguration(problems(error, origins)) from error
    check_controller(parsed, getattr(config.evaluation, "laws", ()))
    return config


def compose_plain(overrides: Sequence[str], config_dir: Path | None = None) -> dict[str, Any]:
    """Return what the files and overrides say, not validated and without defaults.

    Raises:
        UsageError, ConfigurationError: as `compose`.
    """
    return _composed(overrides, config_dir)[0]


def _composed(overrides: Sequence[str], config_dir: Path | None) -> tuple[dict[str, Any], Origins, list[Override]]:
    overrides, study = with_study(overrides)
    found = catalogue(config_dir, study)
    with _hydra(found) as loader:
        parsed = [_parse(text, loader, found) for text in overrides]
        check(parsed, found)
        words = [for_hydra(override, found.groups()) for override in parsed]
        data, files = _load(words, loader, found)
    groups = {override.key: override.text for override in parsed if override.key in found.groups()}
    keys = [override for override in parsed if override.key not in groups]
    origins = Origins(found, files, groups, [override.key for override in keys])
    check_entries(keys, origins, data)
    return data, origins, parsed


def expand_multirun(overrides: Sequence[str], config_dir: Path | None = None) -> list[list[str]]:
    """Return the overrides of every run: the product of all sweeps, ``a=1,2``, ``range(…)`` and ``glob(…)``.

    Raises:
        UsageError: a word is no override, a sweep is empty or has no list of values, or there are too many runs.
    """
    found = catalogue(config_dir)
    with _hydra(found) as loader:
        parsed = [_parse(text, loader, found) for text in overrides if study_file(text) is None]
    choices = [[text] for text in overrides if study_file(text) is not None]
    for override in parsed:
        if override.sweep is None:
            choices.append([override.text])
            continue
        if not override.sweep:
            raise UsageError(f"'{override.text}' names no run")
        choices.append([f"{override.text.partition('=')[0]}={value}" for value in override.sweep])
    jobs = [list(job) for job in itertools.islice(itertools.product(*choices), MOST_JOBS + 1)]
    if len(jobs) > MOST_JOBS:
        raise UsageError(f"-m asks for more than {MOST_JOBS} runs; many design points belong into the axes of a survey")
    return jobs


def to_yaml(config: RunConfig) -> str:
    """The resolved configuration as YAML; keys such as `on` and `n` are quoted."""
    return OmegaConf.to_yaml(OmegaConf.create(config.model_dump(mode="json")))


@contextmanager
def _hydra(found: Catalogue) -> Iterator[ConfigLoader]:
    """Hydra over the catalogue's directories; whatever Hydra application we are called from finds its own again."""
    ours: tuple[type, ...] = (GlobalHydra, JobRuntime, version.VersionBase)
    saved = {kind: Singleton._instances.pop(kind) for kind in ours if kind in Singleton._instances}
    try:
        version.setbase("1.3")
        Plugins.instance()
        path = ConfigSearchPathImpl()
        path.append("hydra", "pkg://hydra.conf")
        if found.study is not None:
            ConfigStore.instance().store(found.study.stem, _read(found.study), "experiment", "_global_")
        for directory in found.directories:
            path.append("main", f"file://{directory}")
        path.append("schema", "structured://")
        Hydra.create_main_hydra2("fracctl", path)
        yield GlobalHydra.instance().config_loader()
    finally:
        if found.study is not None:
            ConfigStore.instance().repo.get("experiment", {}).pop(f"{found.study.stem}.yaml", None)
        for kind in ours:
            Singleton._instances.pop(kind, None)
        Singleton._instances.update(saved)


def _read(study: Path) -> DictConfig:
    try:
        content = OmegaConf.load(study)
    except Exception as error:
        raise ConfigurationError(_reason(error)) from error
    if not isinstance(content, DictConfig):
        raise ConfigurationError(f"{study.name}: must be a mapping of keys, as 'fracctl init' writes it")
    return content


def _load(words: list[str], loader: ConfigLoader, found: Catalogue) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Return the composed plain data, and the files it is made of with their packages."""
    try:
        defaults = loader.compute_defaults_list(_PRIMARY, words, RunMode.RUN).defaults
        config = hydra_compose(_PRIMARY, words)
    except Exception as error:
        raise ConfigurationError(_reason(error)) from error
    files = [
        (entry.config_path, entry.package or "")
        for entry in defaults
        if entry.config_path is not None and not entry.config_path.startswith("hydra/")
    ]
    paths = [found.file(config_path) for config_path, _ in files]
    trapped = [problem for path in paths if path is not None for problem in traps(path)]
    if trapped:
        raise InvalidConfiguration(trapped)
    return _plain(config), files


def _plain(config: DictConfig) -> dict[str, Any]:
    try:
        data = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    except MissingMandatoryValue as error:
        raise ConfigurationError(f"{error.full_key} has no value; set {error.full_key}=VALUE") from error
    except Exception as error:
        where = f"{error.full_key}: " if isinstance(error, InterpolationResolutionError) else ""
        raise ConfigurationError(f"{where}{_first_line(error)}") from error
    assert isinstance(data, dict)
    _require_text_keys(data, "")
    return {str(key): value for key, value in data.items()}


def _require_text_keys(data: Any, path: str) -> None:
    for key, value in data.items() if isinstance(data, dict) else ():
        if not isinstance(key, str):
            raise ConfigurationError(f"the key {key!r} under '{path}' is not text; put it in quotes")
        _require_text_keys(value, f"{path}.{key}".removeprefix("."))


def _parse(text: str, loader: ConfigLoader, found: Catalogue) -> Override:
    if "=" not in text and not text.startswith("~"):
        near = suggestion(text, studies_here())
        hint = near or suggestion(text, found.options("experiment")).replace("'", "'experiment=", 1)
        name = text.removesuffix(".yaml")
        cure = hint or f"; 'fracctl init {name}' writes one, 'fracctl list experiments' names what there is"
        raise UsageError(f"'{text}' is neither an override, KEY=VALUE, nor a study, for there is no {name}.yaml{cure}")
    try:
        parsed = OverridesParser.create().parse_override(text)
        parsed.config_loader = loader  # for glob(…)
        sweep = _sweep(parsed)
        value = None if sweep is not None else parsed.value()
    except UsageError:
        raise
    except Exception as error:
        cure = "put values with special characters in quotes, KEY=\"'VALUE'\""
        raise UsageError(f"cannot read '{text}' ({_first_line(error)}); {cure}") from error
    return Override(text, parsed.key_or_group, value, sweep, parsed.is_delete(), parsed.package)


def _sweep(parsed: HydraOverride) -> tuple[str, ...] | None:
    """Values of a sweep as words, None for a plain value; ranges are rounded, 0.94 and not 0.9400000000000001."""
    if not parsed.is_sweep_override():
        return None
    if not parsed.is_discrete_sweep():
        raise UsageError(f"'{parsed.input_line}' has no list of values; write KEY=A,B or KEY=range(START,STOP,STEP)")
    values = itertools.islice(parsed.sweep_iterator(), MOST_JOBS + 1)
    if parsed.value_type == ValueType.RANGE_SWEEP:
        return tuple(f"{value:.12g}" if isinstance(value, float) else str(value) for value in values)
    return tuple(Transformer.str(value) for value in values)


def _reason(error: Exception) -> str:
    """What Hydra means, in one line."""
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        mark = error.problem_mark
        return f"{mark.name}, line {mark.line + 1}: not valid YAML ({error.problem})"
    cause = error
    while isinstance(cause.__cause__, Exception) and not str(cause).strip():
        cause = cause.__cause__
    lines = [line.strip() for line in str(cause).splitlines() if line.strip()]
    if lines and lines[0].startswith("Could not delete"):
        return f"there is no key {_QUOTED.findall(lines[0])[0]} to remove"
    if lines and lines[0].startswith("Error merging override"):
        word = lines[0].partition("++")[2]
        cure = f"set its keys one by one, {word.partition('=')[0]}.KEY=VALUE"
        return f"cannot set '{word}': a mapping stays a mapping; {cure}"
    if lines and lines[0].startswith("Could not override"):
        return f"the defaults of {_PRIMARY}.yaml have no group {_QUOTED.findall(lines[0])[0]}"
    detail = f" ({_first_line(cause.__cause__)})" if isinstance(cause.__cause__, Exception) else ""
    return (lines[0] if lines else type(error).__name__) + detail


def _first_line(error: BaseException) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0] if lines else type(error).__name__
