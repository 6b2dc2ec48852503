"""Rendered views kept on disk, so that a second run of the benchmark starts with the estimates."""

import hashlib
import inspect
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from tests.support import lightfield

_FOLDER = Path(os.environ.get("RIG_BENCHMARK_CACHE", Path(__file__).parents[1] / "out" / "renders"))


def stored(
    make: Callable[[], NDArray[np.floating]],
    told: str,
    *written_in: ModuleType | Callable[..., object],
) -> NDArray[np.float32]:
    """What `make` returns, made once for the same description and the same source.

    Args:
        make: renders.
        told: everything that the result depends on, as text.
        *written_in: functions or modules whose source the result depends on.

    Returns:
        The array, as float32 whether it was made or read.
    """
    source = "".join(_source(part) for part in (lightfield, *written_in))
    key = hashlib.sha256((told + source).encode()).hexdigest()[:24]
    path = _FOLDER / f"{key}.npy"
    if path.is_file():
        return np.load(path)
    made = np.asarray(make(), np.float32)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".{os.getpid()}.npy")
    np.save(partial, made)
    partial.replace(path)
    return made


@cache
def _source(part: ModuleType | Callable[..., object]) -> str:
    """As it is now: one run of the benchmark does not follow what is edited meanwhile."""
    return inspect.getsource(part)
