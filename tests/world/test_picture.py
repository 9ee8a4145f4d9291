"""Pictures off screen: what draws them, and refusals."""

import pytest

from scla_mj.errors import SclaError
from scla_mj.world import opengl


def test_where_nothing_can_draw_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(opengl.ctypes.util, "find_library", lambda name: None)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", opengl.VARIABLE):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(SclaError, match=r"neither a display nor EGL nor OSMesa is there.*apt install libegl1"):
        opengl.make_contexts(None)


def test_a_display_that_is_not_there_is_passed_over(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("DISPLAY", ":7654")
    monkeypatch.setenv(opengl.VARIABLE, "osmesa")
    monkeypatch.setattr(opengl, "without_display", lambda: iter(["egl"]))
    assert list(opengl._choices()) == ["osmesa", "egl"]
