"""Colours as a terminal meets them: there by default, gone with NO_COLOR, never in a file or pipe."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

COLOUR = re.compile(r"\x1b\[[\d;]*?(?<!\d)(?:3[0-8]|4[0-8]|9[0-7]|10[0-7])(?!\d)[\d;]*m")
"""An escape sequence that sets a colour, whatever else it sets."""
RUN = ["-m", "fracctl", "run", "figures=null", "scheduler=serial", "--json"]
REPRODUCED = """
from fracctl.cli.reproduce import _show_wrapped
_show_wrapped([["id", "verdict", "reason"], ["one", "reproduced", ""], ["two", "not_reproduced", "for it hangs"]])
"""
REFUSED = ["-m", "fracctl", "run", "sede=1"]
HELP = ["-m", "fracctl", "run", "--help"]


def shown(
    words: list[str], folder: Path, given: dict[str, str], terminal: bool = True, out: bool = True
) -> tuple[str, str]:
    """Return what stands on a terminal, or in a pipe in its place, and what the other stream's pipe holds.

    Args:
        words: of the interpreter.
        folder: where it runs.
        given: variables of colour; no other one is set.
        terminal: whether there is a terminal.
        out: whether it is standard output that goes there, or standard error.
    """
    unset = ("NO_COLOR", "FORCE_COLOR", "CLICOLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE", "COLORTERM")
    environment = {name: value for name, value in os.environ.items() if name not in unset}
    environment |= {"TERM": "xterm-256color", "COLUMNS": "120", "LINES": "40"} | given
    screen, end = pty.openpty() if terminal else os.pipe()
    streams = {"stdout": end, "stderr": subprocess.PIPE} if out else {"stdout": subprocess.PIPE, "stderr": end}
    process = subprocess.Popen(
        [sys.executable, *words], cwd=folder, env=environment, stdin=subprocess.DEVNULL, **streams
    )  # type: ignore[call-overload]
    os.close(end)
    found = bytearray()
    with suppress(OSError):  # how the end of a terminal shows
        while piece := os.read(screen, 65536):
            found += piece
    os.close(screen)
    other = b"".join(part for part in process.communicate() if part)
    return found.decode(), other.decode()


def test_the_pattern_knows_colours_from_other_sequences() -> None:
    assert all(COLOUR.search(f"\x1b[{code}m") for code in ("31", "1;32", "38;5;237", "38;2;249;38;114", "0;97", "44"))
    assert not any(COLOUR.search(f"\x1b[{code}") for code in ("0m", "1m", "1;3m", "2K", "?25l", "3A", "30A"))


@pytest.mark.parametrize(
    ("given", "coloured"),
    [
        ({}, True),
        ({"NO_COLOR": ""}, True),
        ({"NO_COLOR": "1"}, False),
        ({"NO_COLOR": "1", "FORCE_COLOR": "1"}, False),
        ({"TERM": "dumb"}, False),
    ],
    ids=lambda given: " ".join(f"{name}={value}" for name, value in given.items()) if isinstance(given, dict) else "",
)
def test_a_terminal_has_colours_unless_they_are_not_wanted(
    given: dict[str, str], coloured: bool, tmp_path: Path
) -> None:
    bar, result = shown(RUN, tmp_path, given, out=False)
    assert "custom" in bar or given.get("TERM") == "dumb"
    assert bool(COLOUR.search(bar)) == coloured, bar
    assert "\x1b" not in result
    table, _ = shown(["-c", REPRODUCED], tmp_path, given)
    assert "not_reproduced" in table
    assert bool(COLOUR.search(table)) == coloured, table


@pytest.mark.parametrize("given", [{}, {"FORCE_COLOR": "1"}], ids=["nothing", "FORCE_COLOR=1"])
def test_a_file_has_none(given: dict[str, str], tmp_path: Path) -> None:
    """Nor has it a bar, whatever is forced: a log is for reading."""
    errors, result = shown(RUN, tmp_path, given, terminal=False, out=False)
    assert errors == ""
    assert result.startswith("{")
    assert "\x1b" not in result


@pytest.mark.parametrize("words", [HELP, REFUSED], ids=["help", "refusal"])
def test_help_and_refusals_obey_too(words: list[str], tmp_path: Path) -> None:
    out = words is HELP
    plain = shown(words, tmp_path, {}, terminal=False, out=out)[0]
    assert ("usage:" if out else "error: unknown key 'sede'") in plain
    assert "\x1b" not in plain
    assert not COLOUR.search(shown(words, tmp_path, {"NO_COLOR": "1"}, out=out)[0])
