"""Two runs are compared in what they store: nothing is called the same that neither of them kept."""

import dataclasses

from scla_mj import RunConfig, rollout
from scla_mj.engine.difference import compare_runs
from scla_mj.engine.inspection import inspect_run

TABULAR = RunConfig(brain="q-learning", epochs=1, decisions=3, telemetry="off")


def test_what_neither_run_stores_is_named_and_not_called_the_same(tmp_path):
    folders = [tmp_path / "one", tmp_path / "other"]
    for seed, folder in enumerate(folders):
        rollout(dataclasses.replace(TABULAR, seed=seed), folder, pictures=False)
    differing = compare_runs(*map(inspect_run, folders))
    assert not differing.same and differing.absent == ("brain",)
    sentence = differing.sentence()
    assert sentence.startswith("differ: settings (seed), decisions from epoch 1, decision 1 on, summary (")
    assert sentence.endswith("); neither run stores weights or action probabilities")
    alike = "are the same to the bit: settings, 3 decisions{}; neither run stores {}weights or action probabilities"
    assert compare_runs(*2 * [inspect_run(folders[0])]).sentence() == alike.format(", summary", "")
    for name in ("seal.json", "summary.json", "brain.npz"):
        (folders[0] / name).unlink()
    assert compare_runs(*2 * [inspect_run(folders[0])]).sentence() == alike.format("", "a summary, ")
