"""One input, read within bounds: what came of it."""

import resource
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass

from rig.errors import RigError

MOST_S = 1.0
"""Of processor time."""
MOST_BYTES = 200_000_000
"""More than the program had before."""
_STUCK_S = 20.0


@dataclass(frozen=True)
class Trial:
    """What one input did."""

    outcome: str
    """`read`, `refused`, or what is wrong."""
    cpu_s: float

    @property
    def is_broken(self) -> bool:
        """Whether it did what no input may do."""
        return self.outcome not in ("read", "refused")


class StuckError(BaseException):
    """Nothing catches it on its way."""


def bound_memory() -> None:
    """Let this process take so much more address space and no more."""
    with open("/proc/self/statm", encoding="ascii") as file:  # noqa: PTH123  (no real file)
        pages = int(file.read().split()[0])
    most = pages * resource.getpagesize() + MOST_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def tried(read: Callable[[], object]) -> Trial:
    """Read once."""
    signal.signal(signal.SIGVTALRM, _stuck)
    signal.setitimer(signal.ITIMER_VIRTUAL, _STUCK_S)
    begun_s = time.process_time()
    try:
        outcome = _outcome(read)
    except StuckError:
        outcome = f"stuck for {_STUCK_S:g} s"
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    cpu_s = time.process_time() - begun_s
    if outcome in ("read", "refused") and cpu_s > MOST_S:
        outcome = f"{cpu_s:.1f} s of processor time"
    return Trial(outcome, cpu_s)


def _outcome(read: Callable[[], object]) -> str:
    try:
        read()
    except RigError as error:
        told = str(error)
        return (
            "refused" if "\n" not in told and len(told) < 3000 else f"no one line: {told[:200]!r}"
        )
    except Exception as error:
        return _place_of(error)
    return "read"


def _place_of(error: Exception) -> str:
    inner = error.__traceback__
    places: list[str] = []
    while inner is not None:
        code = inner.tb_frame.f_code
        if "/rig" in code.co_filename:
            places.append(f"{code.co_filename.rpartition('/rig')[2]}:{inner.tb_lineno}")
        inner = inner.tb_next
    return f"{type(error).__name__} at {' '.join(places[-2:])}: {str(error)[:120]}"


def _stuck(_: int, __: object) -> None:
    raise StuckError
