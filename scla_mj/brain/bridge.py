"""A brain that lives in another Python: a process of its own, asked over two pipes (docs/bridge.md).

`--brain PYTHON:SCRIPT.py` names both, so nothing is started that the user did not name, as with any code of their own.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
import selectors
import signal
import subprocess
import time
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Final, TypeVar

import numpy as np

from scla_mj.anatomy import Anatomy, Projection, stacked
from scla_mj.brain import bridge_child
from scla_mj.brain.base import Brain
from scla_mj.checked import CheckedConfig
from scla_mj.errors import SclaError
from scla_mj.grid import Action
from scla_mj.signals import Activity, Decision, Feedback, Percept, Snapshot

_Said = TypeVar("_Said", Activity, Snapshot)

_LIMIT: Final = "answer_within_s"
"""The setting that every such brain has."""
_LIMIT_S: Final = 120.0
"""Long enough for Brian2 to be imported and to compile on a busy machine."""
_KINDS: Final = {kind.__name__: kind for kind in (bool, int, float, str)}
"""Of settings."""
_MOST_BYTES: Final = 1 << 28
"""Of one answer: several times the text of a million weights; more is nonsense."""
_PATIENCE_S: Final = 2.0
"""For a process to end by itself once nothing more is asked."""


def is_bridge(name: str) -> bool:
    """Return whether a brain's name means `PYTHON:SCRIPT.py`."""
    return name.endswith(".py") and ":" in name


def bridge_class(name: str) -> type[Brain]:
    """Return the brain's class, with the settings that its script declares: for these the script is started.

    Raises:
        SclaError: it cannot be started, or does not answer as it should.
    """
    python, _, script = name.rpartition(":")
    if not python:
        raise SclaError(f"--brain {name} names no Python: write PYTHON:{script}, such as python3:{script}")
    try:
        status = Path(script).stat()
    except OSError as error:
        raise SclaError(f"--brain {name}: the script {script} cannot be read: {error.strerror}") from error
    return _class(name, Path(script).absolute(), status.st_mtime_ns)


@functools.cache
def _class(name: str, script: Path, _: int) -> type[Brain]:
    child = _Child(name)
    try:
        declared = [(_LIMIT, "float", _LIMIT_S), *child.hello["settings"]]
        fields = [(field, _KINDS[kind], default) for field, kind, default in declared]
        settings = dataclasses.make_dataclass("Settings", fields, frozen=True)
        versions = {f"bridge.{package}": str(version) for package, version in child.hello["versions"].items()}
        kind = ResumableBridge if child.hello["resumable"] else Bridge
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        kinds = ", ".join(_KINDS)
        raise SclaError(f"--brain {name}: a setting must be one of {kinds}, with a default; {error!r}") from error
    return type("Bridge", (kind,), {"Settings": settings, "name": name, "versions": versions, "waiting": [child]})


class _Child:
    """The process. `ask` has one answer for each question, or ends in a sentence; `hello` is what it said at first."""

    def __init__(self, name: str) -> None:
        self._name, self.limit_s = name, _LIMIT_S
        self._fault: SclaError | None = None
        python, _, script = name.rpartition(":")
        command = [python, bridge_child.__file__, script]
        pipe = subprocess.PIPE
        try:  # in a session of its own: Ctrl-C is for this process alone
            self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, start_new_session=True)
        except OSError as error:
            raise SclaError(f"--brain {name}: {python} cannot be started: {error.strerror}") from error
        assert self._process.stdin and self._process.stdout
        self._end = weakref.finalize(self, _end, self._process)
        self._questions, self._answers = self._process.stdin, self._process.stdout
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._answers, selectors.EVENT_READ)
        self.hello = self._answer("script")

    def ask(self, call: str, *content: Any) -> Any:
        """Return what the script's brain answers to a call.

        Raises:
            SclaError: there is no answer within the limit of time, or it is an error or nonsense.
        """
        if self._fault is not None:
            raise self._fault
        with contextlib.suppress(OSError):  # it has ended: the answer says how
            self._questions.write(bridge_child.packed([call, *content]).encode())
            self._questions.flush()
        return self._answer("__init__()" if call == "init" else f"{call}()")

    def _answer(self, what: str) -> Any:
        line = self._line(what)
        try:
            message = bridge_child.unpacked(line)
            if "value" in message:
                return message["value"]
            error = str(message["error"])
        except (ValueError, KeyError, TypeError) as fault:
            raise self._failed(f"its {what} gave what is no answer: {line[:40]!r}") from fault
        raise SclaError(f"--brain {self._name}: its {what} raised {error}")

    def _line(self, what: str) -> bytes:
        line, until = bytearray(), time.monotonic() + self.limit_s
        while not line.endswith(b"\n"):
            if not self._selector.select(until - time.monotonic()):
                raise self._failed(f"its {what} gave no answer within {self.limit_s:g} s (--brain.answer-within-s)")
            piece = os.read(self._answers.fileno(), 1 << 20)
            line += piece
            if not piece:
                raise self._failed(f"its process ended in its {what}, {self._how()}")
            if len(line) > _MOST_BYTES:
                raise self._failed(f"its {what} gave an answer without an end")
        return bytes(line)

    def _how(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            code = self._process.wait(_PATIENCE_S)
            return f"by signal {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
        return "or closed its output"

    def _failed(self, sentence: str) -> SclaError:
        self._end()
        self._fault = SclaError(f"--brain {self._name}: {sentence}")
        return self._fault


def _end(process: subprocess.Popen[bytes]) -> None:
    """End the process: by itself, as nothing more is asked, or else by force."""
    assert process.stdin and process.stdout
    with contextlib.suppress(OSError):  # what was not read is not read any more
        process.stdin.close()
    try:
        process.wait(_PATIENCE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    process.stdout.close()


class Bridge(Brain):
    """Passes everything on to the script's class `Brain`."""

    reads = ()
    name: ClassVar[str]
    versions: ClassVar[dict[str, str]]
    """Of the other Python, and of what the script imports by name."""
    waiting: ClassVar[list[_Child]]
    """The process that was asked for its settings, until a brain has taken it."""

    def __init__(self, checked: CheckedConfig, settings: Any) -> None:
        super().__init__(checked, settings)
        self._child = self.waiting.pop() if self.waiting else _Child(self.name)
        self._elapsed_s = 0.0
        own, config, clock = dataclasses.asdict(settings), checked.config, checked.clock
        self._child.limit_s = own.pop(_LIMIT)
        times = {"thinking_ms": clock.thinking_steps * clock.neural_step_ms, "step_ms": clock.neural_step_ms}
        run = {"seed": config.seed, "cells": config.grid.cells, **times, "config": dataclasses.asdict(config)}
        self.anatomy = self._anatomy(self._child.ask("init", run, own))

    def _anatomy(self, declared: Any) -> Anatomy | None:
        if declared is None:
            return None
        try:
            named = declared.get("projections", [])
            projections = [Projection(name, source, target, tuple(shape)) for name, source, target, shape in named]
            return Anatomy(stacked(*declared["populations"]), tuple(projections))
        except (SclaError, KeyError, TypeError, ValueError, AttributeError) as error:
            wanted = "populations, (name, size, role) each, and projections, (name, source, target, shape) each"
            raise SclaError(f"--brain {self.name}: its anatomy must be a dict of {wanted}: {error}") from error

    def decide(self, percept: Percept) -> Decision:
        """Ask for 0 to 3 (up, down, left, right), or a dict with the fields of a `Decision`."""
        said = self._child.ask("decide", _plain(percept))
        fields = said if isinstance(said, dict) else {"action": said}
        try:
            advised, spikes = fields.get("advised"), fields.get("motor_spikes")
            return Decision(Action(fields["action"]), None if advised is None else Action(advised), spikes)
        except (KeyError, ValueError) as error:
            wanted = "0 to 3 (up, down, left, right), or a dict with action, advised and motor_spikes"
            raise SclaError(f"--brain {self.name}: its decide() must return {wanted}; it gave {said!r:.80}") from error

    def elapse(self, duration_s: float) -> None:
        """Remember it: `learn` says it too."""
        self._elapsed_s = duration_s

    def learn(self, feedback: Feedback) -> None:
        """Tell the outcome."""
        places = {"before": _plain(feedback.before), "after": _plain(feedback.after)}
        self._child.ask("learn", feedback._asdict() | places | {"duration_s": self._elapsed_s})

    def activity(self) -> Activity | None:
        """Ask a brain with an anatomy for a dict with the fields of an `Activity`."""
        if self.anatomy is None:
            return None
        still = np.zeros(len(self.anatomy.projections))
        return self._fields("activity", Activity, {"mean_weights": still, "dopamine": still})

    def snapshot(self) -> Snapshot:
        """Ask for a dict with the fields of a `Snapshot`."""
        return self._fields("snapshot", Snapshot, {})

    def _fields(self, method: str, kind: Callable[..., _Said], defaults: dict[str, Any]) -> _Said:
        said = self._child.ask(method)
        try:
            return kind(**defaults | ({} if said is None else said))
        except TypeError as error:
            wanted = f"a dict with the fields of {kind.__name__}"
            raise SclaError(f"--brain {self.name}: its {method}() must return {wanted}: {error}") from error


class ResumableBridge(Bridge):
    """One whose script has `state` and `restore`."""

    def state(self) -> dict[str, Any] | None:
        """Ask for all that changes."""
        state: dict[str, Any] = self._child.ask("state")
        return state

    def restore(self, state: dict[str, Any]) -> None:
        """Hand it back."""
        self._child.ask("restore", state)


def _plain(percept: Percept) -> dict[str, Any]:
    return {"cell": percept.cell, "sensed": percept.sensed}
