"""Pictures off screen: what draws them, and refusals."""

import os
import sys
import types

import pytest

from scla_mj.errors import SclaError
from scla_mj.world import opengl


def test_where_nothing_can_draw_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(opengl.ctypes.util, "find_library", lambda name: None)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", opengl.VARIABLE):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(SclaError, match=r"nor EGL nor OSMesa is there.*install libegl1.*install libosmesa6"):
        opengl.make_contexts(None)


def test_a_display_that_is_not_there_is_passed_over(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("DISPLAY", ":7654")
    monkeypatch.setenv(opengl.VARIABLE, "osmesa")
    monkeypatch.setattr(opengl, "without_display", lambda: iter(["egl"]))
    assert list(opengl._choices()) == ["osmesa", "egl"]


def test_what_fails_leaves_no_choice_behind_for_what_is_tried_next(monkeypatch):
    monkeypatch.setattr(opengl, "_choices", lambda: iter(["egl", "osmesa"]))
    monkeypatch.delenv("PYOPENGL_PLATFORM", raising=False)
    monkeypatch.setenv(opengl.VARIABLE, "nosuch")
    tried = []

    def fail(module):
        tried.append((module, os.environ[opengl.VARIABLE], os.environ.get("PYOPENGL_PLATFORM")))
        os.environ["PYOPENGL_PLATFORM"] = module  # as MuJoCo's modules do
        sys.modules[f"OpenGL.of_{module}"] = sys
        raise ImportError("no device")

    monkeypatch.setattr(opengl.importlib, "import_module", fail)
    with pytest.raises(SclaError, match=r"\(egl: no device; osmesa: no device\)"):
        opengl.make_contexts(None)
    assert tried == [("mujoco.egl", "egl", None), ("mujoco.osmesa", "osmesa", None)]
    assert os.environ[opengl.VARIABLE] == "nosuch" and "PYOPENGL_PLATFORM" not in os.environ
    assert not [name for name in sys.modules if name.startswith("OpenGL.of_")]


def test_a_context_in_which_mujoco_cannot_draw_is_given_back(monkeypatch):
    made = []

    class Context:
        def __init__(self, width, height):
            made.append(self)
            self.is_free = False

        def make_current(self):
            pass

        def free(self):
            self.is_free = True

    monkeypatch.setitem(sys.modules, "mujoco.egl", types.SimpleNamespace(GLContext=Context))
    monkeypatch.setattr(opengl, "_choices", lambda: iter(["egl"]))
    with pytest.raises(SclaError, match="no picture can be drawn here"):
        opengl.make_contexts("no model")
    assert [context.is_free for context in made] == [True]
