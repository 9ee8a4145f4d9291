"""Silent change: short runs still give the bits that are committed, in this process and in any other."""

import json
import os
import subprocess
import sys
from pathlib import Path

import bits
import pytest

from scla_mj.config import RunConfig
from scla_mj.engine.build import simulate
from scla_mj.runs.decisions import row

COMMITTED = json.loads(bits.FILE.read_text(encoding="utf-8")).get(bits.where())
ON_PURPOSE = (
    "the bits of a run have changed at the same seed: if that was meant, run `python tests/bits.py`, commit bits.json "
    "and name the change with its reason in CHANGELOG.md; if not, the last change to the code is at fault"
)


def rows_of(simulations, decisions):
    """Every simulation's decisions, the simulations stepping in turn."""
    rows = [[] for _ in simulations]
    for _ in range(decisions):
        for simulation, taken in zip(simulations, rows, strict=True):
            taken.append(row(simulation.step()))
    return rows


@pytest.mark.parametrize("brain", ["scla", "q-learning"])
def test_robots_that_step_in_turn_in_one_process_do_what_each_does_alone(brain):
    configs = [RunConfig(seed=seed, brain=brain) for seed in (0, 1, 0)]
    beside = rows_of([simulate(config) for config in configs], 60)
    alone = [rows_of([simulate(config)], 60)[0] for config in configs]
    assert beside == alone
    assert alone[0] == alone[2] != alone[1]


@pytest.fixture(scope="module")
def found():
    return bits.digests()


def of_part(runs, part):
    return {name: digests[part] for name, digests in runs.items()}


@pytest.mark.skipif(
    COMMITTED is None or not bits.versions().items() <= COMMITTED["versions"].items(),
    reason="bits are committed for other versions",
)
@pytest.mark.parametrize("part", ["decided", "memory", "measured"])
def test_short_runs_give_the_committed_bits(found, part):
    if part == "measured" and COMMITTED["libm"] != bits.libm():
        pytest.skip("the C library's sine has other last bits here than where the digests were made")
    assert of_part(found, part) == of_part(COMMITTED["runs"], part), ON_PURPOSE


def test_another_process_with_other_hashes_threads_compiler_and_folder_gives_the_same_bits(found, tmp_path):
    elsewhere = {
        "PYTHONHASHSEED": "4711",
        "OMP_NUM_THREADS": "3",
        "OPENBLAS_NUM_THREADS": "3",
        "NUMBA_NUM_THREADS": "1",
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),  # compiled anew...
        "NUMBA_CPU_NAME": "generic",  # ...for the oldest processor of this architecture
        "NUMBA_CPU_FEATURES": "",
    }
    command = [sys.executable, bits.FILE.with_suffix(".py"), "--print"]
    done = subprocess.run(command, cwd=tmp_path, env=os.environ | elsewhere, capture_output=True, check=True)
    assert json.loads(done.stdout)["runs"] == found


def test_a_digest_is_of_every_column_and_every_array(found):
    assert len(set(of_part(found, "memory").values())) >= 6  # random and shortest-path remember nothing
    assert found["scla-dopamine any-start float32"]["decided"] != found["scla-dopamine any-start float64"]["decided"]
    assert Path(bits.FILE).stat().st_size < 10_000
