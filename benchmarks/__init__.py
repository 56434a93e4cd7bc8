"""The product measured: against what was asked, against the bare matrix products, and against its peers, in one run.

`make bench`, or `python -m benchmarks [SECTION …]` in an environment with the extra `bench`.
"""
