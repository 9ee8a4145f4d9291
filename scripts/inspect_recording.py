"""`python scripts/inspect_recording.py RUN`: the same as `scla-mj inspect RUN`."""

import sys

from scla_mj.__main__ import main

if __name__ == "__main__":
    sys.argv.insert(1, "inspect")
    sys.exit(main())
