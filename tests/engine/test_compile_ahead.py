"""Compiling the drive in a second process."""

import os
import subprocess
import sys

from scla_mj.engine.compile_ahead import CompiledAhead
from scla_mj.loop.periods import run_periods

_COLD = """
from pathlib import Path
from scla_mj.engine.compile_ahead import CompiledAhead, compile_here
from scla_mj.loop.periods import run_periods
assert not list(Path(run_periods.stats.cache_path).glob("*.nbc"))
ahead = CompiledAhead(run_periods)
ahead.join()
assert not run_periods.signatures
compile_here()
print(sum(run_periods.stats.cache_hits.values()), sum(run_periods.stats.cache_misses.values()))
"""


def test_a_second_process_leaves_the_compiled_drive_in_the_cache_for_this_one(tmp_path):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", _COLD], env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["1", "0"]


def test_no_second_process_is_started_where_the_drive_is_compiled_already():
    CompiledAhead(run_periods).join()
    again = CompiledAhead(run_periods)
    assert not again.is_running
