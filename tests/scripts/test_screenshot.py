"""The viewer that takes the picture is gone when the picture is taken: the program that its wrapper starts too."""

import os
import time
from pathlib import Path

import pytest


def is_running(process_id):
    """Whether a process is there and no zombie that waits to be reaped."""
    try:
        return Path(f"/proc/{process_id}/stat").read_text().rpartition(") ")[2][0] not in "ZX"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks the kernel through /proc")
@pytest.mark.parametrize("wrapper_stays", [True, False])
def test_what_a_wrapper_starts_ends_with_it(screenshot, tmp_path, wrapper_stays):
    told = tmp_path / "pid"
    script = f"sleep 30 & echo $! > {told}.new; mv {told}.new {told}; {'wait' if wrapper_stays else 'exit'}"
    deadline = time.monotonic() + 10
    with pytest.raises(RuntimeError), screenshot._group_of(["sh", "-c", script], dict(os.environ)) as process:
        while not told.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        started = int(told.read_text())
        if not wrapper_stays:
            process.wait()
        assert is_running(started)
        raise RuntimeError("whatever happens within")
    while is_running(started) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not is_running(started)
