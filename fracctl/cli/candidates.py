"""What a word of the command line may become: commands, flags, groups, options, keys and their values."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

from fracctl.cli.parser import Parser
from fracctl.config.catalogue import Catalogue, catalogue
from fracctl.config.keys import dotted, settings
from fracctl.config.registry import BUILT_IN, names
from fracctl.config.studies import studies_here, study_file

FILES = "<files>"
"""Among candidates: the shell completes paths of files and directories too."""
Candidate = tuple[str, str]
"""A word and what it means."""

_GLOBAL = (("--help", "show the commands"), ("--version", "show the version"))
_TAKES_RUNS = ("validate", "compare", "report", "resume")


def split(line: str) -> tuple[list[str], str]:
    """Return the words of a line before the last one, and the last one as far as it is typed; quotes are taken off."""
    words, word, quote, inside = [], "", "", False
    for letter in line:
        if quote:
            quote, word = ("", word) if letter == quote else (quote, word + letter)
        elif letter in "'\"":
            quote, inside = letter, True
        elif letter.isspace():
            words += [word] if inside else []
            word, inside = "", False
        else:
            word, inside = word + letter, True
    return words, word


def candidates(line: str, commands: Mapping[str, ModuleType]) -> list[Candidate]:
    """Return what the last word of a line, `fracctl` first, may become."""
    words, typed = split(line)
    words = [word for word in words[1:] if word != "--debug"]
    if not words:
        known = [(name, module.SUMMARY) for name, module in commands.items()]
        return _beginning(typed, [*known, *(_GLOBAL if typed.startswith("-") else ())])
    command, rest = words[0], words[1:]
    if command not in commands:
        return []
    parser: Parser = commands[command].parser()
    flag = _flag(parser, rest[-1]) if rest else None
    if flag is not None and flag.nargs != 0:
        return _beginning(typed, [(str(choice), "") for choice in flag.choices]) if flag.choices else [(FILES, "")]
    if typed.startswith("-"):
        described = [(name, action) for action in parser.arguments for name in action.option_strings]
        return _beginning(typed, [(name, str(action.help)) for name, action in described if action.help])
    return list(_positional(command, parser, rest, typed))


def _flag(parser: Parser, word: str) -> argparse.Action | None:
    return next((action for action in parser.arguments if word in action.option_strings), None)


def _positional(command: str, parser: Parser, before: list[str], typed: str) -> Iterable[Candidate]:
    action = next((action for action in parser.arguments if not action.option_strings), None)
    if action is not None and action.choices:
        return _beginning(typed, [(str(choice), "") for choice in action.choices])
    if command == "reproduce":
        return _beginning(typed, [(name, "") for name in _papers()])
    found = _catalogue(before)
    if command == "list":
        groups = [("experiments", "what there is to run"), ("runs", "what is stored")]
        return _beginning(typed, [*groups, *((group, "") for group in found.groups() if group != "experiment")])
    if action is None or action.dest != "overrides":
        return [(FILES, "")] if action is not None else []
    paths = [(FILES, "")] if command in _TAKES_RUNS and "=" not in typed else []
    return [*_overrides(found, before, typed), *paths]


def _catalogue(words: list[str]) -> Catalogue:
    """The catalogue that a line asks for by --config-dir and by the name of a study."""
    given = next((second for first, second in pairwise(words) if first == "--config-dir"), None)
    given = given or next((word.partition("=")[2] for word in words if word.startswith("--config-dir=")), None)
    study = next((file for word in words if (file := study_file(word)) is not None), None)
    return catalogue(Path(given).expanduser() if given else None, study)


def _overrides(found: Catalogue, before: list[str], typed: str) -> Iterator[Candidate]:
    chosen = [f"experiment={found.study.stem}", *before] if found.study is not None else before
    key, equals, value = typed.partition("=")
    if not equals:
        yield from _keys(found, chosen, typed)
        return
    entries = _options(found, key) if key in found.groups() else list(_values(settings(found, chosen), key))
    place = max(value.rfind(letter) for letter in "[,") + 1
    taken = value[:place].strip("[").split(",")
    for entry, meaning in _beginning(value[place:], [entry for entry in entries if entry[0] not in taken]):
        yield f"{key}={value[:place]}{entry}", meaning


def _keys(found: Catalogue, before: list[str], typed: str) -> Iterator[Candidate]:
    """Groups, studies, and keys one part at a time."""
    tilde, plain = typed[: len(typed) - len(typed.lstrip("~+"))], typed.lstrip("~+")
    if not tilde and "." not in plain:
        if found.study is None:
            yield from _beginning(typed, [(name, f"{name}.yaml") for name in studies_here()])
        yield from _beginning(typed, [(f"{group}=", "a group") for group in found.groups()])
    offered: dict[str, str] = {}
    for key, value in _with_axes(settings(found, before)):
        if key.startswith(plain):
            part, more, _ = key[len(plain) :].partition(".")
            end = "." if more else "" if tilde.startswith("~") else "="
            offered[f"{tilde}{plain}{part}{end}"] = "" if more else f"is {_written(value)}"
    yield from offered.items()


def _with_axes(nested: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """All keys; of a survey with axes, those of the parameters that have none too."""
    yield from dotted(nested)
    axes = nested.get("survey", {}).get("axes")
    for name in nested.get("controller", {}) if axes is not None else ():
        if name != "type" and name not in axes:
            yield f"survey.axes.{name}", None


def _values(nested: dict[str, Any], key: str) -> Iterator[Candidate]:
    """What a key may be, as far as files say: what it is, names of types and of objectives, truth values."""
    value = dict(_with_axes(nested)).get(key)
    group, _, rest = key.partition(".")
    kind = group if group in BUILT_IN else f"{group}s"
    if rest.rpartition(".")[2] == "type" and kind in BUILT_IN:
        yield from ((name, "") for name in names(kind))
    elif isinstance(value, bool):
        yield from (("true", ""), ("false", ""))
    elif key == "objective":
        yield from ((name, "") for name in nested.get("objectives", {}))
    elif value is not None and not isinstance(value, list | dict):
        yield _written(value), "as it is"


def _written(value: Any) -> str:
    return "null" if value is None else f"{value}".lower() if isinstance(value, bool) else str(value)


def _options(found: Catalogue, group: str) -> list[Candidate]:
    return [(option, found.summary(group, option).partition(". ")[0]) for option in found.options(group)]


def _papers() -> Iterator[str]:
    from fracctl.reproduction.suites import read_suite, suite_names

    for name in suite_names():
        yield name
        yield from (f"{name}/{section}" for section in read_suite(name).sections)


def _beginning(typed: str, known: Iterable[Candidate]) -> list[Candidate]:
    return [(word, meaning) for word, meaning in known if word.startswith(typed)]
