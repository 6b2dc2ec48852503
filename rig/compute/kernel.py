"""The one door to numba: compiles a function, keeps its type, caches the machine code on disk."""

import logging
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core import event

Function = TypeVar("Function", bound=Callable[..., Any])
_log = logging.getLogger(__name__)


class _Notice(event.Listener):
    """Says once why the first estimate of an installation takes its time."""

    def __init__(self) -> None:
        self._is_due = True

    def on_start(self, event: event.Event) -> None:
        """A kernel is compiled, not read from disk."""
        if self._is_due:
            self._is_due = False
            _log.warning("compiling loops for this processor: once, about half a minute")

    def on_end(self, event: event.Event) -> None:
        """See `on_start`."""


event.register("numba:compile", _Notice())


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
