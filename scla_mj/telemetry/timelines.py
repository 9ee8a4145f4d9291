"""The three timelines of every row, as Rerun's columns."""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

from scla_mj.telemetry import names


def time_columns(time_s: ArrayLike, decision: NDArray[np.int64], epoch: NDArray[np.int64]) -> list[rr.TimeColumn]:
    """Return simulated time, decision (over the whole run, from 1) and epoch as index columns of equal length."""
    nanoseconds = np.round(np.asarray(time_s, float) * 1e9).astype("timedelta64[ns]")
    return [
        rr.TimeColumn(names.SIM_TIME, duration=nanoseconds),
        rr.TimeColumn(names.DECISION, sequence=decision),
        rr.TimeColumn(names.EPOCH, sequence=epoch),
    ]


def set_time(stream: rr.RecordingStream, time_s: float, decision: int, epoch: int) -> None:
    """Set all three for the next row that is logged on its own."""
    stream.set_time(names.SIM_TIME, duration=np.timedelta64(round(time_s * 1e9), "ns"))
    stream.set_time(names.DECISION, sequence=decision)
    stream.set_time(names.EPOCH, sequence=epoch)
