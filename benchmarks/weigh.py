"""Run a command from a small process, and write its exit code, seconds on the clock and peak memory to a file.

A process inherits the peak of the one that started it; started from a large one it would seem as large.

    python weigh.py RESULT COMMAND…
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time

if __name__ == "__main__":
    start = time.perf_counter()
    code = subprocess.call(sys.argv[2:])
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    with open(sys.argv[1], "w", encoding="utf-8") as result:  # noqa: PTH123 - nothing else is worth loading here
        result.write(f"{code} {seconds} {peak}")
