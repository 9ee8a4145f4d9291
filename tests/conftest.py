"""What every test can take for granted, wherever the tests were started from."""

import importlib.util
import signal
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="session", autouse=True)
def _ctrl_c_reaches_tests_that_were_started_in_the_background():
    """A shell starts its background jobs deaf to Ctrl-C, and their children inherit that."""
    before = signal.getsignal(signal.SIGINT)
    if before == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def screenshot():
    """Return scripts/screenshot.py as a module."""
    file = Path(__file__).parents[1] / "scripts" / "screenshot.py"
    spec = importlib.util.spec_from_file_location("screenshot", file)
    module = importlib.util.module_from_spec(spec)
    sys.modules["screenshot"] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    yield module
    del sys.modules["screenshot"]
