"""`python scripts/rollout.py RUN`: the same as `scla-mj rollout RUN`."""

import sys

from scla_mj.__main__ import main

if __name__ == "__main__":
    sys.argv.insert(1, "rollout")
    sys.exit(main())
