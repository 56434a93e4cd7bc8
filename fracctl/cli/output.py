"""Standard output and error, quiet where the reader has gone: `fracctl list | head -1`."""

from __future__ import annotations

import json
import math
import os
import sys
from typing import Any, TextIO


def prepare() -> None:
    """Let a terminal that lacks a character show a question mark instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")


def say(text: str = "") -> None:
    """Write a line to standard output at once; nothing happens where nobody reads it."""
    _write(sys.stdout, text + "\n")


def say_json(value: Any) -> None:
    """Write a value as one line of JSON; numbers that JSON cannot hold become null."""
    say(json.dumps(_finite(value), ensure_ascii=False, allow_nan=False, default=str))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def remark(text: str) -> None:
    """Write a line to standard error."""
    _write(sys.stderr, text + "\n")


def flush() -> None:
    """Flush both streams; what a vanished reader left unread is dropped."""
    for stream in (sys.stdout, sys.stderr):
        try:
            _write(stream, "")
        except OSError:
            _discard(stream)


def _write(stream: TextIO | None, text: str) -> None:
    if stream is None:  # closed by whoever started us
        return
    try:
        stream.write(text)
        stream.flush()
    except BrokenPipeError:
        _discard(stream)


def _discard(stream: TextIO | None) -> None:
    """Send all further output to the null device, so that the interpreter's last flush finds a reader."""
    if stream is None:
        return
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, stream.fileno())
    os.close(null)
