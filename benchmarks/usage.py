"""Run fracctl's command line in this process, and print what this process and those that it started have used.

The last line of the output is `seconds own_cpu workers_cpu own_peak workers_peak`, in seconds and MiB.

    python usage.py ARGUMENT…
"""

from __future__ import annotations

import resource
import sys
import time

if __name__ == "__main__":
    start = time.perf_counter()
    from fracctl.cli.main import main

    code = main(sys.argv[1:])
    seconds = time.perf_counter() - start
    scale = 2.0**20 if sys.platform == "darwin" else 2.0**10
    own, others = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    cpu = [used.ru_utime + used.ru_stime for used in (own, others)]
    print(seconds, *cpu, *(used.ru_maxrss / scale for used in (own, others)))
    sys.exit(code)
