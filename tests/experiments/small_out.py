"""An OUT of known runs, one experiment for every part of a report, and how to read it back by hand."""

import csv

import numpy as np
from synthetic_out import learning, write_runs

from scla_mj.config import RunConfig
from scla_mj.experiments.campaign import run_folder
from scla_mj.experiments.experiment import Experiment, Target, with_settings
from scla_mj.runs.decisions import read_decisions

COMMAND = "scla-mj reproduce OUT --only 'a & b'"
BASE = RunConfig(brain="scla-printed", epochs=4, decisions=300, telemetry="off")
DOPAMINE = with_settings(BASE, brain="scla-dopamine")
SENSED = with_settings(BASE, protocol="sensed-start")
JUMP = with_settings(BASE, task={"jump_epoch": 3, "jump_target": (1, 5)})
FOUR, THREE = (0, 1, 2, 3), (0, 1, 2)

EXPERIMENTS = (
    Experiment("scla-any", "paper", "SCLA <b>any</b> | start & more", "Does it learn?", BASE, FOUR, "automaton-any", (
        Target("at least 5 % of | the ceiling", 2, 4, "mean percent of ceiling", 5.0),
        Target("at most 1 hit", 1, 4, "mean hits per 1000", 0.0, 1.0),
        Target("needs epoch 9", 9, 9, "mean hits per 1000", 0.0),
    )),
    Experiment("scla-sensed", "paper", "SCLA, sensed", "Does the network?", SENSED, FOUR),
    Experiment("one-any", "paper", "one dopamine, any-start", "Both?", DOPAMINE, FOUR, "scla-any", (
        Target("as good", 3, 4, "equivalent percent of ceiling", -30.0, 30.0, rivals=("scla-any",)),
        Target("apart", 2, 4, "least weight gap, mV", 1.0),
        Target("off the upper bound", 2, 4, "most mean weight, mV", 0.0, 3.96),
    )),
    Experiment("automaton-any", "paper", "automaton", "What alone?", with_settings(BASE, brain="automaton"), FOUR),
    Experiment("random-any", "comparison", "random", "Chance?", with_settings(BASE, brain="random"), THREE, None,
               (Target("no seed under 90 %", 1, 4, "worst seed percent of ceiling", 90.0),)),
    Experiment("jump", "world", "printed, the target jumps", "Without a hint?", JUMP, THREE),
    Experiment("jump-one", "world", "one, the target jumps", "And this?", with_settings(JUMP, brain="scla-dopamine"),
               THREE, "jump"),
    Experiment("large", "world", "6x6", "Larger?", with_settings(BASE, grid={"cells": (6, 6)}), (7,)),
    Experiment("no-rule", "ablation", "no local rule", "Needed?", with_settings(BASE, automaton={"local_rule": False}),
               THREE, "scla-any"),
    Experiment("absent", "ablation", "never run", "?", with_settings(BASE, automaton={"reward_rate": 0.1}), THREE,
               "scla-any", (Target("anything", 1, 4, "mean hits per 1000", 0.0),)),
    Experiment("scalar", "ablation", "one dopamine", "Enough?",
               with_settings(SENSED, plasticity={"modulation": "scalar"}), THREE, "scla-sensed"),
    Experiment("noisy", "world", "p = 0.3", "Astray?", with_settings(BASE, task={"action_noise": 0.3}), THREE),
    Experiment("crossed", "world", "crossed", "Reward?", with_settings(BASE, task={"crossed_epoch": 2}), THREE),
    Experiment("rung", "ladder", "a step", "Who?", with_settings(BASE, brain="dyna-q"), THREE, "scla-any"),
    Experiment("automata-everywhere-any-start", "ladder", "no network", "Who?",
               with_settings(BASE, brain="automata-everywhere"), THREE, "scla-any"),
    Experiment("slower", "ablation", "slower", "Less?", with_settings(DOPAMINE, automaton={"reward_rate": 0.2}), THREE,
               "one-any"),
    Experiment("killed", "ablation", "killed", "?", with_settings(BASE, automaton={"reward_rate": 0.9}), THREE),
)  # fmt: skip
BY_NAME = {experiment.name: experiment for experiment in EXPERIMENTS}
SKILLS = {"automaton-any": 0.2, "random-any": 0.0, "no-rule": 0.6, "noisy": 1.0, "rung": 0.5,
          "automata-everywhere-any-start": 0.97}  # fmt: skip


def fill(out, experiments=EXPERIMENTS):
    for experiment in experiments:
        if experiment.name == "killed":
            write_runs(out, experiment, learning(1.0), decisions=500)
        elif experiment.name != "absent":
            fixed = SKILLS.get(experiment.name)
            write_runs(out, experiment, learning(1.5) if fixed is None else lambda epoch, skill=fixed: skill)


def read_csv(out, name):
    with (out / "csv" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def hits_by_hand(out, experiment):
    """Hits per 1000 (seeds, epochs), counted from the tables of decisions."""
    rows = []
    for seed in experiment.seeds:
        table = read_decisions(run_folder(out, experiment, seed))
        counts = np.bincount(table["epoch"].to_numpy(), table["hit"].to_numpy())[1:]
        rows.append(1000 * counts / experiment.config.decisions)
    return np.array(rows)
