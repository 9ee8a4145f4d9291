"""`python scripts/resume.py RUN`: the same as `scla-mj resume RUN`."""

import sys

from scla_mj.__main__ import main

if __name__ == "__main__":
    sys.argv.insert(1, "resume")
    sys.exit(main())
