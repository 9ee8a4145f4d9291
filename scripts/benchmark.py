"""`python scripts/benchmark.py`: the same as `scla-mj bench`."""

import sys

from scla_mj.__main__ import main

if __name__ == "__main__":
    sys.argv.insert(1, "bench")
    sys.exit(main())
