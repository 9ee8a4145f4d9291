"""`python scripts/reproduce_paper.py OUT`: the same as `scla-mj reproduce OUT`."""

import sys

from scla_mj.__main__ import main

if __name__ == "__main__":
    sys.argv.insert(1, "reproduce")
    sys.exit(main())
