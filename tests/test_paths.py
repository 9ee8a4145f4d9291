"""The shipped files are found, and a run's files have names of their own."""

from pathlib import Path

from scla_mj import paths
from scla_mj.world.robot import BURGER


def test_the_assets_folder_holds_the_arena_and_the_robot():
    assert (paths.assets_folder() / paths.SCENE_XML).is_file()
    assert BURGER.file.is_file()


def test_every_file_of_a_run_has_a_plain_name_of_its_own():
    names = [
        value for value in vars(paths).values() if isinstance(value, str) and value.endswith(("json", "png", "npz"))
    ]
    names += [paths.DECISIONS_PARQUET, paths.DECISIONS_PARTIAL, paths.RECORDING_RRD]
    assert len(set(names)) == len(names) >= 8
    assert all(Path(name).name == name for name in names)
