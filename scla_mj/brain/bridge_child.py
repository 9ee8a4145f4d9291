"""`PYTHON bridge_child.py SCRIPT.py`: the bridge's side in another Python, of which it needs the standard library.

The script's class `Brain` answers what comes over standard input, an object of JSON a line; the answers go to what was
standard output. What the script prints goes to standard error, and its standard input is empty. Nothing is unpickled.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import os
import platform
import runpy
import sys
import traceback
from types import SimpleNamespace
from typing import Any

_ARRAY = "$array"
"""An array is an object with this key, its dtype, its `shape`, and its bytes, `data`, in base64."""
_NUMBERS = "biuf"


def packed(value: Any) -> str:
    """Return a line of JSON; arrays and scalars of numpy, and of whatever is like it, may stand anywhere in `value`."""
    return json.dumps(value, default=_plain, separators=(",", ":")) + "\n"


def _plain(value: Any) -> Any:
    if not (hasattr(value, "dtype") and hasattr(value, "tobytes") and value.dtype.kind in _NUMBERS):
        raise TypeError(f"{type(value).__name__} is neither plain data nor an array of numbers")
    if not value.shape:
        return value.item()
    return {_ARRAY: value.dtype.str, "shape": value.shape, "data": base64.b64encode(value.tobytes()).decode()}


def unpacked(line: bytes) -> Any:
    """Return what a line of JSON holds, arrays as numpy arrays of one's own."""
    return json.loads(line, object_hook=_array)


def _array(content: dict[str, Any]) -> Any:
    if _ARRAY not in content:
        return content
    import numpy as np  # a brain without numpy has sent no arrays, and gets none

    if (dtype := np.dtype(content[_ARRAY])).kind not in _NUMBERS:
        raise ValueError(f"an array of {dtype} holds no numbers")
    return np.frombuffer(base64.b64decode(content["data"]), dtype).reshape(content["shape"]).copy()


def _named(value: Any) -> Any:
    """Return nested dicts as namespaces: `feedback.after.cell`."""
    return SimpleNamespace(**{k: _named(v) for k, v in value.items()}) if isinstance(value, dict) else value


class _Served:
    """The script's brain, asked by the names of its methods."""

    def __init__(self, script: str) -> None:
        self._script = script
        self._kind: Any = None
        self._brain: Any = None

    def answer(self, call: str, *content: Any) -> str:
        """Return a line with the value that a call returns, or with what it raised."""
        try:
            own = getattr(self, f"_{call}", None)
            return packed({"value": own(*content) if own else self._of_the_brain(call, *content)})
        except BaseException as error:
            return packed({"error": self._described(error)})

    def _script_hello(self) -> dict[str, Any]:
        sys.path[0] = os.path.dirname(os.path.abspath(self._script))  # noqa: PTH100, PTH120
        sys.argv = [self._script]
        found = runpy.run_path(self._script, run_name="brain")
        self._kind = found.get("Brain")
        if not isinstance(self._kind, type):
            raise TypeError("the script has no class Brain")
        settings = getattr(self._kind, "Settings", None)
        fields = dataclasses.fields(settings) if settings else ()
        kinds = [(field.name, getattr(field.type, "__name__", field.type), field.default) for field in fields]
        imported = {getattr(module, "__name__", ""): getattr(module, "__version__", None) for module in found.values()}
        versions = {"python": platform.python_version(), **{name: v for name, v in imported.items() if name and v}}
        resumable = hasattr(self._kind, "state") and hasattr(self._kind, "restore")
        return {"settings": kinds, "resumable": resumable, "versions": versions}

    def _init(self, run: Any, settings: Any) -> Any:
        own = getattr(self._kind, "Settings", None)
        self._brain = self._kind(_named(run), *([own(**settings)] if own else []))
        return getattr(self._brain, "anatomy", None)

    def _restore(self, state: Any) -> None:
        self._brain.restore(state)  # dicts as they were

    def _of_the_brain(self, call: str, *content: Any) -> Any:
        must = call in ("decide", "learn")
        method = getattr(self._brain, call) if must else getattr(self._brain, call, lambda: None)
        return method(*map(_named, content))

    def _described(self, error: BaseException) -> str:
        lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == self._script]
        text = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        return f"{text}, {self._script} line {lines[-1]}" if lines else text


def main(script: str) -> None:
    """Answer until nobody asks any more."""
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    served = _Served(script)
    line = served.answer("script_hello")
    while True:
        answers.write(line)
        answers.flush()
        if not (asked := calls.readline()).endswith(b"\n"):
            return
        line = served.answer(*unpacked(asked))


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except BrokenPipeError:  # nobody listens any more
        os._exit(0)
