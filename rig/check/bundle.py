"""`rig check --bundle FILE`: what support needs, as one file to be sent.

Only texts go in. From all of them passwords, users in addresses and the folder of the user are
taken out.
"""

import io
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

from rig.disk import disk_explained
from rig.errors import StoreError
from rig.files import sync_folder
from rig.secrets import without_people

_MODE = 0o600
_README = """What `rig check --bundle` found out about a rig, for whoever is to help.

{files}

Passwords and users in addresses are three stars, the user's folder is ~. Pictures of a report show
what the cameras saw. Look through it before you send it.
"""


def require_new(file: Path) -> None:
    """Make sure that a bundle can be put there, before anything is looked at.

    Raises:
        StoreError: something is there already, or its folder is not.
    """
    if file.is_symlink() or file.exists():
        raise StoreError(
            f"asked to write the bundle {file}, it exists already",
            advice="name another file, or remove it",
        )
    if not file.parent.is_dir():
        raise StoreError(
            f"asked to write the bundle {file}, there is no folder {file.parent}",
            advice="make the folder, or name another one",
        )


def write_bundle(file: Path, texts: Mapping[str, str]) -> dict[str, int]:
    """Write texts into a new zip file that only the user may read; all of it or nothing.

    Args:
        file: is not there.
        texts: by name in the bundle.

    Returns:
        What is inside: bytes by name.

    Raises:
        StoreError: the file is there, or cannot be written.
    """
    require_new(file)
    home = str(Path.home())
    shown = {
        name: without_people(text, "" if home == "/" else home).encode(errors="replace")
        for name, text in texts.items()
    }
    listed = "\n".join(f"{name}: {len(content)} bytes" for name, content in shown.items())
    shown = {"README.txt": _README.format(files=listed).encode(), **shown}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as bundle:
        for name, content in shown.items():
            bundle.writestr(name, content)
    with disk_explained("write the bundle", file):
        _put(file, packed.getvalue())
    return {name: len(content) for name, content in shown.items()}


def _put(file: Path, content: bytes) -> None:
    """Write a new file; what could not be finished is not left behind.

    Raises:
        OSError: something has come to its place, or the disk fails.
    """
    handle = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _MODE)  # follows no link
    try:
        with os.fdopen(handle, "wb") as opened:
            opened.write(content)
            opened.flush()
            os.fsync(opened.fileno())
    except BaseException:
        file.unlink()
        raise
    sync_folder(file.parent)
