"""The one door to numba: compiles a function, keeps its type, caches the machine code on disk."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel() -> Callable[[Function], Function]:
    """Return a decorator that compiles with numba, without the interpreter lock.

    The compiler may fuse a product and a sum (one rounding less), never reorder sums: the same
    input gives the same bits.
    """

    def compile_function(function: Function) -> Function:
        # Divisions as in numpy (infinite, no exception): a loop that may raise does not vectorise.
        compiled = numba.njit(nogil=True, cache=True, fastmath={"contract"}, error_model="numpy")
        return cast("Function", compiled(function))

    return compile_function
