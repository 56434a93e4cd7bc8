"""A survey of 200 000 points whose workers and parent are killed while it goes on."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fracctl.cli.main import main
from fracctl.config.compose import compose
from fracctl.execution.run import execute
from fracctl.store import RunDirectory
from tests.execution.test_perform import tables_of
from tests.faults.processes import ROOT, children_of, ended, is_running, parts_in, until

WORDS = [
    *("experiment=ic1_outofplane", "survey.axes.alpha_w=0.405:1:0.005", "solver.cross_check=0", "figures=[]"),
    *("scheduler=local", "scheduler.workers=2"),
]
N_POINTS = 120 * 41 * 41
N_BLOCKS = 120


@pytest.mark.slow
def test_a_survey_of_200_000_points_outlives_three_kills(tmp_path: Path) -> None:
    whole = execute(compose([*WORDS, f"output_dir={tmp_path / 'whole'}"])).run_directory
    folder, chance = tmp_path / "killed", random.Random(2026)
    moments = sorted(chance.sample(range(2, 100), 3))
    command = [sys.executable, "-m", "fracctl", "run", *WORDS, f"output_dir={folder}"]
    process = subprocess.Popen(command, cwd=ROOT, env=os.environ, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with ended(process):
        for moment in moments[:2]:
            until(lambda least=moment: len(parts_in(folder)) >= least)  # type: ignore[misc]
            until(lambda: len(children_of(process.pid)) == 2)
            os.kill(chance.choice(children_of(process.pid)), signal.SIGKILL)
        until(lambda: len(parts_in(folder)) >= moments[2])
        workers = children_of(process.pid)
        process.kill()
        process.wait()
        until(lambda: not any(is_running(pid) for pid in workers), seconds=5.0)
    kept = len(parts_in(folder))
    directory = parts_in(folder)[0].parents[1]
    assert moments[2] <= kept < N_BLOCKS
    assert main(["resume", str(directory)]) == 0
    log = (directory / "run.log").read_text()
    assert log.count("is tried again: its worker process was killed by signal 9") == 2
    assert f"{N_BLOCKS} blocks: {kept} were stored, 0 failed" in log
    assert tables_of(directory) == tables_of(whole)
    points = RunDirectory(directory).evaluations(["point"])["point"].to_numpy()
    assert np.array_equal(points, np.arange(N_POINTS))
    assert RunDirectory(directory).verify() == []
