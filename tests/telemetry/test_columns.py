"""What is sent is the same however it is cut into columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from synthetic_run import record_run, records

from scla_mj.telemetry import names, recording
from scla_mj.telemetry.reading.chunks import open_recording


@pytest.mark.parametrize("mode", ["light", "full"])
def test_it_does_not_matter_how_many_decisions_are_sent_together(tmp_path, monkeypatch, mode):
    run = list(records(epochs=1, decisions=40, spikes=60, thinking_spikes=20))
    run[11] = run[11]._replace(activity=None)
    run[25] = run[25]._replace(move=run[25].move._replace(trajectory=np.empty((0, 12))))
    for name, decisions in (("one", 500), ("many", 7)):
        monkeypatch.setattr(recording, "_DECISIONS_A_FLUSH", decisions)
        record_run(tmp_path / f"{name}.rrd", mode, run)
    one, many = (columns_of(tmp_path / f"{name}.rrd") for name in ("one", "many"))
    assert one == many
    assert len(one["world/trajectory", "LineStrips3D:strips"]) == 39
    assert len(one["brain/spikes/MU", "Points2D:positions"]) == 39


def columns_of(path: Path) -> dict[tuple[str, str], list[object]]:
    """Return all that is recorded over time, row after row, but for the rows' own numbers."""
    columns: dict[tuple[str, str], list[object]] = {}
    with open_recording(path, untrusted=False) as file:
        for chunk in file.chunks():
            if chunk.has(names.DECISION):
                for name, column in zip(chunk.rows.schema.names, chunk.rows.columns, strict=True):
                    if name != "rerun.controls.RowId":
                        columns.setdefault((chunk.entity, name), []).extend(column.to_pylist())
    return columns


@pytest.mark.parametrize("mode", ["light", "full"])
def test_every_row_carries_the_decision_of_its_time_and_that_decisions_epoch(tmp_path, mode):
    run = list(records(epochs=3, decisions=15, spikes=60, thinking_spikes=20))
    record_run(tmp_path / "r.rrd", mode, run)
    starts_s = np.array([record.time_s for record in run])
    ends_s = np.array([record.move.trajectory[-1, 0] for record in run])
    seen = set()
    with open_recording(tmp_path / "r.rrd", untrusted=False) as file:
        for chunk in file.chunks():
            if chunk.has(names.DECISION):
                number = chunk.decision - 1
                np.testing.assert_array_equal(chunk.epoch, number // 15 + 1)
                assert (starts_s[number] - 1e-9 <= chunk.time_s).all()
                assert (chunk.time_s <= ends_s[number] + 1e-9).all()
                seen.add(chunk.entity)
    assert {"world/robot", "world/trajectory", names.SPIKES, names.WINDOWS, names.HIT, f"{names.RATES}/MU"} <= seen
