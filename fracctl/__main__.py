"""`python -m fracctl`."""

import sys

from fracctl.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
