"""The one door to numba: compiles a function, keeps its type, caches the machine code on disk."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(*, parallel: bool = False, fastmath: bool = False) -> Callable[[Function], Function]:
    """Return a decorator that compiles with numba, without the interpreter lock.

    Args:
        parallel: run `numba.prange` loops on several threads.
        fastmath: let the compiler reorder floating-point sums; never where bits must repeat.
    """

    def compile_function(function: Function) -> Function:
        # Divisions as in numpy (infinite, no exception): a loop that may raise does not vectorise.
        compiled = numba.njit(
            nogil=True, cache=True, parallel=parallel, fastmath=fastmath, error_model="numpy"
        )
        return cast("Function", compiled(function))

    return compile_function
