"""What is plugged in and what a profile calls it, and how to look for it all at once."""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from rig.errors import RigError


@dataclass(frozen=True, slots=True)
class FoundPicture:
    """What a new profile asks a camera for: the best that it offers for measuring."""

    pixel_format: str
    width_px: int
    height_px: int
    rate_hz: float


@dataclass(frozen=True, slots=True)
class FoundDevice:
    """One device that is there."""

    name: str
    """What a profile should say: the name that stays when other devices are plugged in."""
    description: str
    """What it calls itself, and what it offers."""
    other_names: tuple[str, ...] = ()
    """Further names of the same device; some of them change from start to start."""
    problem: str | None = None
    """Why it cannot be used as it is, and how to mend that; None if all is well."""
    layout: str | None = None
    """The layout of `rig.profile.parts` that the shape of its pictures suggests, where they may
    hold several views; a guess."""
    picture: FoundPicture | None = None
    """What a new profile asks it for; None where it does not tell what it offers."""


@dataclass(frozen=True, slots=True)
class Findings:
    """What one kind of search found."""

    kind: str
    """Name of the search, such as `v4l2` or `serial`."""
    key: str
    """Key of a profile that takes the names."""
    devices: tuple[FoundDevice, ...] = ()
    note: str | None = None
    """What is missing for the search itself, and how to mend it; None if all is well."""
    took_s: float = 0.0
    title: str = ""
    """What a person calls such devices."""


@dataclass(frozen=True, slots=True)
class Search:
    """One way to look for devices."""

    kind: str
    key: str
    find: Callable[[float], Sequence[FoundDevice]]
    """Called with the time that it may take, s; may raise `RigError`."""
    title: str = ""
    """What a person calls such devices, as `serial ports`."""


@dataclass(slots=True)
class _Answer:
    findings: Findings | None = None
    failure: BaseException | None = None
    done: threading.Event = field(default_factory=threading.Event)


def search_all(searches: Sequence[Search], timeout_s: float) -> tuple[Findings, ...]:
    """Run all searches at the same time; none may take longer than the others are waited for.

    A search that does not end in time is left behind in its thread, and a note says so.

    Args:
        searches: what to look for.
        timeout_s: longest wait for all of them together.
    """
    deadline_s = time.monotonic() + timeout_s
    answers: Mapping[str, _Answer] = {search.kind: _Answer() for search in searches}
    for search in searches:
        threading.Thread(
            target=_run, args=(search, answers[search.kind], timeout_s), daemon=True
        ).start()
    return tuple(_wait(search, answers[search.kind], deadline_s, timeout_s) for search in searches)


def _run(search: Search, answer: _Answer, timeout_s: float) -> None:
    begun_s = time.monotonic()
    try:
        devices = tuple(search.find(timeout_s))
        answer.findings = _findings(search, devices, None, time.monotonic() - begun_s)
    except RigError as error:
        answer.findings = _findings(search, (), str(error), time.monotonic() - begun_s)
    except BaseException as error:
        answer.failure = error
    finally:
        answer.done.set()


def _wait(search: Search, answer: _Answer, deadline_s: float, timeout_s: float) -> Findings:
    answer.done.wait(max(0.0, deadline_s - time.monotonic()))
    if answer.failure is not None:
        raise answer.failure
    if answer.findings is not None:
        return answer.findings
    return _findings(
        search,
        (),
        f"no answer within {timeout_s:.1f} s; give it more time with --timeout-s, or look for a "
        "device that hangs",
        timeout_s,
    )


def _findings(
    search: Search, devices: tuple[FoundDevice, ...], note: str | None, took_s: float
) -> Findings:
    return Findings(search.kind, search.key, devices, note, took_s, search.title or search.kind)
