"""A library that lets calls to the disk fail, or that ends the program at one of them: Linux only.

It is loaded before the C library, so the program that wants it is begun once more; its forked
children arm it.
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

_SOURCE = Path(__file__).with_name("disk_faults.c")
_LIBRARY = "RIG_FAULT_LIBRARY"


def build(folder: Path) -> Path:
    """Compile it.

    Raises:
        FileNotFoundError: there is no C compiler.
    """
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise FileNotFoundError("no C compiler (cc, gcc, clang)")
    made = folder / "disk_faults.so"
    command = [compiler, "-O1", "-shared", "-fPIC", "-o", made, _SOURCE, "-ldl"]
    subprocess.run(command, check=True, capture_output=True)
    return made


def begin_with_it(module: str, arguments: Sequence[str]) -> None:
    """Begin `python -m MODULE ARGUMENTS` anew with the library, unless it was begun so."""
    library = os.environ.pop(_LIBRARY, None)
    if library is not None:
        del os.environ["LD_PRELOAD"]  # for this program alone
        shutil.rmtree(Path(library).parent)  # it is in memory
        return
    library = str(build(Path(tempfile.mkdtemp(prefix="rig-fault-"))))
    around = os.environ | {"LD_PRELOAD": library, _LIBRARY: library}
    os.execve(sys.executable, [sys.executable, "-m", module, *arguments], around)  # noqa: S606


def arm(folder: Path, call: int, count: int, what: int) -> None:
    """Let calls below a folder fail from now on.

    Args:
        folder: only what lies below it is counted, and fails.
        call: the first one that fails, from 1; 0 for none.
        count: so many from there on; 0 for all.
        what: number of the error; 0 writes half and says so; negative for a signal instead.
    """
    ours: Any = ctypes.CDLL(None)
    ours.rig_fault_arm(str(folder).encode(), ctypes.c_long(call), ctypes.c_long(count), what)


def calls() -> int:
    """Return how many calls were counted; 0 where the library was not loaded."""
    ours: Any = ctypes.CDLL(None)
    try:
        counted = ours.rig_fault_calls
    except AttributeError:
        return 0
    counted.restype = ctypes.c_long
    return int(counted())
