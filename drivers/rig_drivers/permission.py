"""Whether this user may open a device, and what to do if not."""

import grp
import os
from pathlib import Path

UDEV = "install the rules that `rig devices --udev-rules` prints, and plug it in again"
"""What to do where a system gives devices of a kind to nobody."""


def why_not_permitted(path: Path) -> str | None:
    """Return why a device file may not be read and written, with what to do; None where it may.

    Args:
        path: an existing device file.
    """
    if os.access(path, os.R_OK | os.W_OK):
        return None
    group = _group_of(path)
    if group is None or group == "root":
        return f"may not be opened; {UDEV}"
    return f"may not be opened; sudo usermod -aG {group} $USER, then log out and in again"


def _group_of(path: Path) -> str | None:
    try:
        return grp.getgrgid(path.stat().st_gid).gr_name
    except (KeyError, OSError):
        return None
