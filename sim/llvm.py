"""Find an LLVM library that mitsuba can use.

Its fast variants need libLLVM from the system. Versions 15 and 16 load, and then abort the whole
process at the first picture; so the version is asked for before mitsuba gets to see the library.
"""

import ctypes
import logging
import os
import re
from collections.abc import Iterator
from pathlib import Path

_log = logging.getLogger(__name__)

OLDEST_MAJOR = 17
VARIABLE = "DRJIT_LIBLLVM_PATH"

_FOLDERS = (
    "/usr/lib/llvm-*/lib",
    "/usr/lib/*-linux-gnu",
    "/usr/lib64",
    "/usr/lib",
    "/usr/local/lib",
)
_NAME = re.compile(r"^libLLVM(?:-(\d+)(?:\.\d+)*\.so(?:\.\d+)*|\.so\.(\d+)(?:\.\d+)*)$")


def usable_llvm() -> Path | None:
    """Return the newest libLLVM of at least `OLDEST_MAJOR`, or None.

    A path in the environment variable DRJIT_LIBLLVM_PATH is the only one considered.
    """
    chosen = os.environ.get(VARIABLE)
    if chosen is not None:
        if _is_usable(Path(chosen)):
            return Path(chosen)
        _log.warning(
            "%s=%s is no libLLVM >= %d; rendering without LLVM, about eight times slower",
            VARIABLE,
            chosen,
            OLDEST_MAJOR,
        )
        return None
    return next(filter(_is_usable, _candidates(_FOLDERS)), None)


def named_major(name: str) -> int | None:
    """Return the major version in a file name such as `libLLVM-19.so.1` or `libLLVM.so.19.1`."""
    match = _NAME.match(name)
    return int(match[1] or match[2]) if match else None


def _candidates(folders: tuple[str, ...]) -> Iterator[Path]:
    """Yield libraries whose name promises a usable version, newest first."""
    found: dict[Path, int] = {}
    for pattern in folders:
        for path in Path("/").glob(pattern.removeprefix("/") + "/libLLVM*.so*"):
            major = named_major(path.name)
            if major is not None and major >= OLDEST_MAJOR:
                found.setdefault(path.resolve(), major)
    yield from sorted(found, key=lambda path: found[path], reverse=True)


def _is_usable(path: Path) -> bool:
    try:
        library = ctypes.CDLL(str(path))
        ask = library.LLVMGetVersion
    except (OSError, AttributeError):  # not a library, or older than LLVM 16, which cannot tell
        return False
    major, minor, patch = ctypes.c_uint(), ctypes.c_uint(), ctypes.c_uint()
    ask(ctypes.byref(major), ctypes.byref(minor), ctypes.byref(patch))
    return major.value >= OLDEST_MAJOR
