"""Why a device file may not be opened. Root may open everything, so another user tries."""

import grp
import os
import subprocess
import sys
from pathlib import Path

import pytest
from rig_drivers.permission import why_not_permitted


def test_a_file_of_ones_own_may_be_opened(tmp_path: Path):
    path = tmp_path / "ttyUSB0"
    path.touch()
    assert why_not_permitted(path) is None


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize(
    ("group", "advice"), [(20, f"usermod -aG {grp.getgrgid(20).gr_name}"), (0, "udev")]
)
def test_the_group_or_the_udev_rule_is_named(group: int, advice: str):
    path = Path(f"/tmp/rig-permission-{os.getpid()}-{group}")  # noqa: S108 - seen by another user
    path.touch(mode=0o660)
    try:
        os.chown(path, 0, group)
        program = (
            f"import os, sys; sys.path[:] = {sys.path!r}; from pathlib import Path; "
            "from rig_drivers.permission import why_not_permitted; "
            "os.setgroups([]); os.setgid(65534); os.setuid(65534); "
            f"print(why_not_permitted(Path({str(path)!r})))"
        )
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, check=True
        )
    finally:
        path.unlink()
    assert advice in done.stdout
