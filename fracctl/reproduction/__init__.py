"""Published tables beside computed ones: suites, verdicts, and the table of both."""
