"""The progress display: on a terminal only, never where it would spoil a file."""

from __future__ import annotations

import io
import sys

import pytest

from fracctl.cli.progress import Bar, display
from fracctl.execution.progress import NoProgress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def drive(progress: object, total: int | None) -> None:
    progress.start(total)  # type: ignore[attr-defined]
    for _ in range(3):
        progress.advance(100)  # type: ignore[attr-defined]
    progress.finish()  # type: ignore[attr-defined]


@pytest.mark.parametrize(("stream", "quiet"), [(io.StringIO(), False), (Terminal(), True)])
def test_silent_without_a_terminal_or_when_asked(
    monkeypatch: pytest.MonkeyPatch, stream: io.StringIO, quiet: bool
) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    progress = display("label", quiet)
    assert isinstance(progress, NoProgress)
    drive(progress, 300)
    assert stream.getvalue() == ""


@pytest.mark.parametrize("total", [300, None])
def test_a_terminal_sees_label_and_rows(monkeypatch: pytest.MonkeyPatch, total: int | None) -> None:
    terminal = Terminal()
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr(sys, "stderr", terminal)
    progress = display("run 1 of 2 [x]", quiet=False)
    assert isinstance(progress, Bar)
    drive(progress, total)
    assert "run 1 of 2 [x]" in terminal.getvalue()
    assert "300" in terminal.getvalue()


def test_finishing_without_having_started() -> None:
    Bar("label").finish()


def test_the_time_left_is_that_of_what_is_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of a survey is stored already, the rest comes in blocks that take a minute."""
    monkeypatch.setattr(sys, "stderr", Terminal())
    bar, now = Bar("label"), [0.0]
    bar._rich.get_time = lambda: now[0]
    bar.start(2000)
    for _ in range(10):
        bar.found(100)
    for _ in range(4):
        now[0] += 60.0
        bar.advance(100)
    task = bar._rich.tasks[0]
    bar.finish()
    assert task.completed == 1400
    assert task.speed == pytest.approx(100.0 / 60.0)
    assert task.time_remaining == pytest.approx(360.0, abs=1.0)
