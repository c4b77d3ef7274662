"""`python -m mjbench`."""

import sys

from mjbench.cli import main

if __name__ == "__main__":
    sys.exit(main())
