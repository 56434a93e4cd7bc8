"""`fracctl init`: a study of one's own, in one file."""

from __future__ import annotations

import argparse

from fracctl.cli import output
from fracctl.cli.parser import Parser
from fracctl.errors import RunError, UsageError

SUMMARY = "write a study to change: one file with the orbit, the start, the spacecraft and several laws"

_DESCRIPTION = """\
Write NAME.yaml: a commented study in km, m, mm/s^2 and minutes, in which several laws fly from one start. 'fracctl run
NAME' computes it, shows a table of all laws and draws their paths. A file that is there already is left alone."""

_EXAMPLES = """\
  fracctl init my_study      writes my_study.yaml
  fracctl run my_study       flies it: one table, one plot, in seconds
  fracctl show my_study      explains it in words and units"""

_NAME_OF_THE_TEMPLATE = "my_study"


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("init", "NAME", _DESCRIPTION, _EXAMPLES)
    parser.add_argument("name", metavar="NAME", help="of the study and of its file, without .yaml")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    from fracctl.config.catalogue import built_in_directory
    from fracctl.config.studies import new_study

    path = new_study(options.name)
    text = (built_in_directory() / "study.yaml").read_text(encoding="utf-8")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text.replace(_NAME_OF_THE_TEMPLATE, path.stem))
    except FileExistsError:
        raise UsageError(f"'{path}' is there already; choose another name, or remove it first") from None
    except OSError as error:
        raise RunError(f"'{path}' cannot be written: {error.strerror}") from error
    word = path.with_suffix("")
    output.say(str(path))
    output.say(f"change it as you like; 'fracctl run {word}' flies it, 'fracctl show {word}' explains it")
    return 0
