"""A recording only grows, so that a checkpoint can vouch for what it was."""

import hashlib
import itertools

import pytest
from synthetic_run import open_part, records

from scla_mj.paths import recording_part


@pytest.mark.parametrize("mode", ["light", "full"])
def test_rerun_only_appends_to_its_file(mode, tmp_path):
    path, seen = tmp_path / recording_part(1), []
    with open_part(tmp_path, 1, mode) as recorder:
        for number, record in enumerate(records(epochs=2, decisions=60, spikes=300, thinking_spikes=80), 1):
            recorder.write(record)
            if number % 13 == 0:
                recorder.sync()
                seen.append(path.read_bytes())
                told = recorder.state()["parts"]
                assert told == [
                    {"name": path.name, "bytes": len(seen[-1]), "sha256": hashlib.sha256(seen[-1]).hexdigest()}
                ]
    seen.append(path.read_bytes())
    assert len({len(content) for content in seen}) == 10
    assert all(after.startswith(before) for before, after in itertools.pairwise(seen))
