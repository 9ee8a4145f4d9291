"""The names that a recording is read back by: entities, timelines, properties. A view's other entities are its own."""

from typing import Final

from scla_mj.signals import Outcome

APPLICATION: Final = "scla_mj"
FORMAT: Final = 1
"""Version of this layout; a reader refuses a newer one."""

SIM_TIME: Final = "sim_time"
DECISION: Final = "decision"
EPOCH: Final = "epoch"

WORLD: Final = "world"
ROBOT: Final = "world/robot"
POLICY: Final = "world/policy"
SPIN: Final = "spin"
"""Below a wheel: how far it has turned."""
TARGET: Final = "world/target"
"""Parent of the target's shapes: a target that jumps moves with it."""

SPIKES: Final = "brain/spikes"
WINDOWS: Final = "brain/spikes/windows"
RATES: Final = "brain/rates"
RATES_WHOLE: Final = "brain/rates_whole_decision"
WEIGHTS: Final = "brain/weights"
WEIGHT_MATRIX: Final = "brain/weight_matrix"
DOPAMINE: Final = "brain/dopamine"
DOPAMINE_OF_ALL: Final = "brain/dopamine/all"
"""Of decisions that release the same at every projection."""

PROBABILITIES: Final = "automaton/probabilities"

HIT: Final = "decisions/hit"
OUTCOME: Final = "decisions/outcome"
OUTCOME_CODES: Final = {outcome: code for code, outcome in enumerate(Outcome)}
POSITION_ERROR_M: Final = "decisions/position_error_m"

EPOCH_HITS: Final = "learning/epoch"
CEILING: Final = "learning/ceiling"

PROPERTIES: Final = "scla"
"""The recording property that carries the run's metadata."""
FIRST_DECISION: Final = "first_decision"
"""Among it: the first decision that a file holds, counted over the run. A resumed run's next part begins above 1."""

ANATOMY: Final = "anatomy"
"""Among it: the brain's populations and projections as JSON, which the entities below `brain` are named after."""

SCALARS: Final = "Scalars:scalars"
POINTS: Final = "Points2D:positions"
CENTRES: Final = "Boxes2D:centers"
HALF_SIZES: Final = "Boxes2D:half_sizes"
TRANSLATION: Final = "Transform3D:translation"
QUATERNION: Final = "Transform3D:quaternion"
