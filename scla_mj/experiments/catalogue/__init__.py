"""Every experiment of the report, as data."""

from typing import Final

from scla_mj.experiments.catalogue.ablations import ABLATION
from scla_mj.experiments.catalogue.brains import COMPARISON, PAPER
from scla_mj.experiments.catalogue.experiment import Experiment, Target, with_settings
from scla_mj.experiments.catalogue.worlds import WORLD

CATALOGUE: Final = PAPER + COMPARISON + WORLD + ABLATION

__all__ = ["ABLATION", "CATALOGUE", "COMPARISON", "PAPER", "WORLD", "Experiment", "Target", "with_settings"]
