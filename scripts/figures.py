"""`python scripts/figures.py RUN`: the same as `scla-mj figures RUN`."""

import sys

from scla_mj.cli.main import main

if __name__ == "__main__":
    sys.argv.insert(1, "figures")
    sys.exit(main())
