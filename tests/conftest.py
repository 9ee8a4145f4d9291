"""What every test can take for granted, wherever the tests were started from."""

import signal

import pytest


@pytest.fixture(scope="session", autouse=True)
def _ctrl_c_reaches_tests_that_were_started_in_the_background():
    """A shell starts its background jobs deaf to Ctrl-C, and their children inherit that."""
    before = signal.getsignal(signal.SIGINT)
    if before == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
