"""Argument parsing with complete flags only, a suggestion for unknown ones, and flags before or after overrides."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from fracctl.errors import UsageError, suggestion


class Parser(argparse.ArgumentParser):
    """The parser of one command.

    Args:
        command: its name.
        words: what may follow, ``[OVERRIDE …]``.
        summary: what it does, in a few lines.
        examples: command lines and what they do, indented by two blanks.
    """

    def __init__(self, command: str, words: str, summary: str, examples: str) -> None:
        super().__init__(
            prog=f"fracctl {command}",
            usage=f"fracctl {command} [OPTION …] {words}",
            description=summary,
            epilog=f"examples:\n{examples}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
            add_help=False,
        )
        self.add_argument("-h", "--help", action="help", help="show this text and exit")
        self.add_argument("--debug", action="store_true", help="show the traceback of an error")

    def add_config_dir(self) -> None:
        """Add --config-dir."""
        self.add_argument(
            "--config-dir",
            type=Path,
            metavar="DIR",
            help="a directory of your own YAML files, laid out as conf/; they win over built-in ones of the same name "
            "(default: $FRACCTL_CONFIG_DIR)",
        )

    def add_json(self, what: str) -> None:
        """Add --json."""
        self.add_argument("--json", action="store_true", help=f"{what}, and nothing else")

    def add_overrides(self, **further: str) -> None:
        """Add the positional arguments group=option and key=value."""
        text = "group=option, group.key=value, or ~group.key to remove a key ('fracctl list' names groups and options)"
        text += "; or the name of a study, my_study for my_study.yaml"
        self.add_argument("overrides", nargs="*", metavar="OVERRIDE", help=further.get("help", text))

    def parse(self, arguments: Sequence[str]) -> argparse.Namespace:
        """Return the parsed arguments.

        Raises:
            UsageError: an option is unknown, or lacks its value.
            ConfigurationError: two words set the same key.
        """
        options, unknown = self.parse_known_intermixed_args(list(arguments))
        for word in unknown:
            raise UsageError(f"unknown option '{word}'{suggestion(word.partition('=')[0], self.flags)}")
        if overrides := getattr(options, "overrides", None):
            from fracctl.config.catalogue import catalogue
            from fracctl.config.overrides import check_once

            check_once(overrides, catalogue(getattr(options, "config_dir", None)).groups())
        return options

    @property
    def arguments(self) -> list[argparse.Action]:
        """All arguments, as they were added."""
        return list(self._actions)

    @property
    def flags(self) -> list[str]:
        """All option strings."""
        return [flag for action in self._actions for flag in action.option_strings]

    def error(self, message: str) -> NoReturn:
        """Raise UsageError instead of exiting."""
        raise UsageError(message)
