"""A growable array that keeps its memory when it is cleared: what is sent together is gathered in the same place."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

_FIRST_ROWS: Final = 1024


class GrowableArray:
    """An array that grows by whole rows, each of a `shape`; `clear` keeps its memory."""

    def __init__(self, dtype: DTypeLike, shape: tuple[int, ...] = ()) -> None:
        self._memory: NDArray[Any] = np.empty((_FIRST_ROWS, *shape), dtype)
        self._filled = 0

    def __len__(self) -> int:
        return self._filled

    @property
    def rows(self) -> NDArray[Any]:
        """A view of what was added, (n, *shape), valid until the next `extend`, `append` or `clear`."""
        return self._memory[: self._filled]

    def extend(self, rows: NDArray[Any]) -> None:
        """Copy rows to the end, (k, *shape)."""
        end = self._filled + len(rows)
        if end > len(self._memory):
            self._grow(end)
        self._memory[self._filled : end] = rows
        self._filled = end

    def append(self, row: Any) -> None:
        """Copy one row to the end: a tuple, where the rows are records."""
        if self._filled == len(self._memory):
            self._grow(self._filled + 1)
        self._memory[self._filled] = row
        self._filled += 1

    def clear(self) -> None:
        """Forget the rows."""
        self._filled = 0

    def _grow(self, rows: int) -> None:
        memory = np.empty((2 * rows, *self._memory.shape[1:]), self._memory.dtype)
        memory[: self._filled] = self.rows
        self._memory = memory
