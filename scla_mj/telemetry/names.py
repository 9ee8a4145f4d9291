"""What a recording's entities, timelines and properties are called: written here, read back by the same names."""

from typing import Final

APPLICATION: Final = "scla_mj"
FORMAT: Final = 1
"""Version of this layout; a reader refuses a newer one."""

SIM_TIME: Final = "sim_time"
DECISION: Final = "decision"
EPOCH: Final = "epoch"

WORLD: Final = "world"
ROBOT: Final = "world/robot"
TARGET: Final = "world/target"
"""Parent of the target's shapes: a target that jumps moves with it."""
TRAJECTORY: Final = "world/trajectory"
POLICY: Final = "world/policy"

BRAIN: Final = "brain"
SPIKES: Final = "brain/spikes"
WINDOWS: Final = "brain/spikes/windows"
RATES: Final = "brain/rates"
RATES_WHOLE: Final = "brain/rates_whole_decision"
WEIGHTS: Final = "brain/weights"
WEIGHT_MATRIX: Final = "brain/weight_matrix"
DOPAMINE: Final = "brain/dopamine"
RASTER_LABELS: Final = "brain/raster/labels"
RASTER_MARGIN: Final = "brain/raster/margin"

PROBABILITIES: Final = "automaton/probabilities"

HIT: Final = "decisions/hit"
OUTCOME: Final = "decisions/outcome"
DURATION_S: Final = "decisions/duration_s"
POSITION_ERROR_M: Final = "decisions/position_error_m"
LOG: Final = "decisions/log"

ABOUT: Final = "about"

LEARNING: Final = "learning"
ROLLING_HITS: Final = "learning/last_100_decisions"
EPOCH_HITS: Final = "learning/epoch"
CEILING: Final = "learning/ceiling"

PROPERTIES: Final = "scla"
"""The recording property that carries the run's metadata."""
FIRST_DECISION: Final = "first_decision"
"""Among it: the first decision that a file holds, counted over the run. A resumed run's next part begins above 1."""
