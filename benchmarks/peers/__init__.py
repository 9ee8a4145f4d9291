"""The same network in other simulators: these files run in an environment of their own and import nothing of scla_mj.

Brian2 wants an older numpy than this package's lock holds. The environment is made in one line (docs/performance.md)
from `requirements.txt`; the bench starts `worker.py` with that environment's interpreter and talks to it over a pipe.
"""

from pathlib import Path
from typing import Final

WORKER: Final = Path(__file__).with_name("worker.py")
REQUIREMENTS: Final = Path(__file__).with_name("requirements.txt")
MODULES: Final = ("numpy", "brian2", "nest")
"""What an environment of the peers must be able to import."""
INSTALL: Final = f"python3 -m venv .peers && .peers/bin/pip install -r {REQUIREMENTS}"
"""The line that makes one."""
PYTHON: Final = Path(__file__).parents[2] / ".peers" / "bin" / "python"
"""Its interpreter, if it was made in the checkout."""
