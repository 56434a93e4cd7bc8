"""`fracctl`: finds the command, runs it, and turns every error into a sentence and an exit code."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from types import ModuleType

from fracctl.cli import (
    compare,
    completion,
    export,
    init,
    listing,
    output,
    reporting,
    reproduce,
    resume,
    run,
    show,
    validate,
)
from fracctl.cli.failure import report
from fracctl.errors import UsageError, suggestion

INTERRUPTED = 130
COMMANDS: dict[str, ModuleType] = {
    "init": init,
    "run": run,
    "resume": resume,
    "compare": compare,
    "reproduce": reproduce,
    "report": reporting,
    "list": listing,
    "show": show,
    "validate": validate,
    "export": export,
    "completion": completion,
}

_HELP = """\
usage: fracctl COMMAND [OPTION …] [OVERRIDE …]

Control of relative orbital motion with derivatives of fractional order: solve, survey, compare, draw.

commands:
{commands}

options:
  -h, --help     show this text; 'fracctl COMMAND --help' explains a command with examples
  --version      show the version
  --debug        show the traceback of an error

a first run:
  fracctl list experiments                   what there is to run
  fracctl run experiment=ic1_outofplane      the best gains and order from IC1, stored and drawn in seconds
  fracctl show experiment=ic1_outofplane     what that computes, in words and units
  fracctl init my_study                      a study to change: the orbit, the start, several laws

exit codes: 0 done, 1 a run failed or a published number does not come out as it must, 2 wrong command line,
            3 wrong configuration, 130 interrupted
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    output.prepare()
    try:
        code = _dispatch(words)
    except SystemExit as request:  # argparse has shown a help text
        code = request.code if isinstance(request.code, int) else 0
    except KeyboardInterrupt:
        output.remark("interrupted; what was computed is kept, and the same command continues")
        code = INTERRUPTED
    except BrokenPipeError:
        code = 0
    except Exception as error:  # noqa: BLE001 - a traceback is for --debug
        code = report(error, debug="--debug" in words)
    output.flush()
    return code


def _dispatch(words: list[str]) -> int:
    while words and words[0] == "--debug":
        words = words[1:]
    if not words:
        output.remark(_help().rstrip())
        return UsageError.exit_code
    first, rest = words[0], words[1:]
    if first in ("-h", "--help"):
        output.say(_help().rstrip())
        return 0
    if first == "--version":
        output.say(f"fracctl {_version()}")
        return 0
    if first not in COMMANDS:
        raise UsageError(_unknown(first))
    if first == "completion" and rest[:1] == [completion.COMPLETE]:
        completion.show_candidates(" ".join(rest[1:]), COMMANDS)
        return 0
    command = COMMANDS[first]
    code: int = command.execute(command.parser().parse(rest))
    return code


def _unknown(word: str) -> str:
    if word.startswith("-"):
        if any(word.partition("=")[0] in command.parser().flags for command in COMMANDS.values()):
            return f"option '{word}' belongs behind a command, as in 'fracctl run {word}'"
        return f"unknown option '{word}'{suggestion(word, ['--help', '--version', '--debug'])}"
    if "=" in word:
        return f"'{word}' is no command; did you mean 'fracctl run {word}'?"
    known = ", ".join(COMMANDS)
    return f"there is no command '{word}'{suggestion(word, COMMANDS) or f'; commands: {known}'}"


def _help() -> str:
    lines = [f"  {name:14} {command.SUMMARY}" for name, command in COMMANDS.items()]
    return _HELP.format(commands="\n".join(lines))


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("fracctl")
    except PackageNotFoundError:
        return "0+unknown"
