"""A mistake in what is handed to Rerun is an error here, not a warning."""

import pytest
import rerun as rr


@pytest.fixture(autouse=True)
def _strict():
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)
