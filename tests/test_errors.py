import errno

import pytest

from scla_mj.errors import remedy


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_wants_room_not_another_folder(number):
    assert remedy(OSError(number, "full"), folder="RUN") == "free the disk"


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS, errno.ENOTDIR, None])
def test_what_cannot_be_written_to_wants_another_folder_by_its_own_name(number):
    for folder in ("RUN", "OUT"):
        said = remedy(OSError(number, "no") if number else OSError("no"), folder=folder)
        assert f"another {folder}" in said and "disk" not in said
