"""Where files live: the MJCF assets that ship with the package, and the names inside a run folder."""

from pathlib import Path
from typing import Final

from scla_mj.errors import SclaError

ROBOT_XML: Final = "robot.xml"
SCENE_XML: Final = "scene.xml"

CONFIG_JSON: Final = "config.json"
DECISIONS_PARQUET: Final = "decisions.parquet"
DECISIONS_PARTIAL: Final = "decisions.partial.arrows"
SUMMARY_JSON: Final = "summary.json"
BRAIN_NPZ: Final = "brain.npz"
EPOCHS_PNG: Final = "epochs.png"
WEIGHTS_PNG: Final = "weights.png"
POLICY_PNG: Final = "policy.png"
RECORDING_RRD: Final = "recording.rrd"


def assets_folder() -> Path:
    """Return the folder that holds the MJCF files, in an installed wheel or in a checkout.

    Raises:
        SclaError: neither place holds the robot's file.
    """
    package = Path(__file__).resolve().parent
    candidates = (package / "assets", package.parent / "assets")
    for folder in candidates:
        if (folder / ROBOT_XML).is_file():
            return folder
    raise SclaError(
        f"the robot's file {ROBOT_XML} is in neither {candidates[0]} nor {candidates[1]}; reinstall scla-mj"
    )
