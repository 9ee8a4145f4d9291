"""What a run has earned does not depend on who looks at it."""

from scla_mj.checked import check
from scla_mj.config import RunConfig
from scla_mj.engine.account import Account
from scla_mj.engine.build import simulate


def test_an_epochs_mean_weights_are_those_at_its_end_and_nobody_elses_look_changes_them():
    config = check(RunConfig(epochs=2, decisions=11))
    simulation, asked, shown = simulate(config), Account(config), Account(config)
    numbers = [(epoch, decision) for epoch in (1, 2) for decision in range(1, 12)][:18]
    means = {}
    for epoch, decision in numbers:
        record = simulation.step()
        means[epoch, decision] = tuple(record.activity.mean_weights.tolist())
        wanted = asked.wants_activity(decision)
        asked.add(record if wanted else record._replace(activity=None), simulation.time_s)
        shown.add(record, simulation.time_s)
    assert len(set(means.values())) > 5
    assert asked.epoch(1).mean_weights == shown.epoch(1).mean_weights == means[1, 11]
    # Of the epoch that was cut short, the last that was due: the run's 17th decision, the epoch's 6th.
    assert asked.epoch(2).mean_weights == shown.epoch(2).mean_weights == means[2, 6]
