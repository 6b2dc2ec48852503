"""Which software made a result, and who ran it how."""

import getpass
import platform
import re
import shlex
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from rig.records import Provenance
from rig.secrets import words_without_secrets

_OURS = "epirig"
_FOR_DEVELOPMENT = {"dev", "docs", "test"}
"""Extras that no result depends on."""


def software_versions() -> dict[str, object]:
    """Return the versions of Python, rig and what it depends on; what is absent is left out."""
    versions: dict[str, object] = {
        "python": platform.python_version(),
        "platform": platform.platform(),
    }
    for name in (_OURS, *_dependencies()):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    return versions


def this_program(tags: Sequence[str] = ()) -> Provenance:
    """Return who runs this program, where and how; secrets of the command line are hidden.

    Args:
        tags: words of the user.
    """
    program = Path(sys.argv[0] or "python")
    name = program.parent.name if program.name == "__main__.py" else program.name
    command = shlex.join([name, *words_without_secrets(sys.argv[1:])])
    return Provenance(_user(), platform.node(), command, tuple(tags))


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # a number that has no name here, as in a container
        return "unknown"


def _dependencies() -> list[str]:
    try:
        lines = requires(_OURS) or []
    except PackageNotFoundError:
        return []
    names: dict[str, None] = {}
    for line in lines:
        extra = re.search(r"extra == ['\"]([\w-]+)['\"]", line)
        found = re.match(r"[A-Za-z0-9._-]+", line)
        if found and not (extra and extra[1] in _FOR_DEVELOPMENT):
            names[found[0]] = None
    return list(names)
