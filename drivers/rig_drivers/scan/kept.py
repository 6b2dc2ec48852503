"""Takes of one scan, and what keeps them: here in memory, `rig_drivers.scan.on_disk` in files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from rig.frames import Frame
from rig_drivers.scan.route import Halt


@dataclass(frozen=True, slots=True)
class Kept:
    """One take that was taken."""

    halt: Halt
    reached_mm: tuple[float, ...]
    """Positions read back, of each carrier."""
    frame: Frame
    session: int
    temperature_degc: float | None


class Keeping(Protocol):
    """Where the takes of one scan are."""

    @property
    def taken(self) -> tuple[Kept, ...]:
        """What there is, in the order in which it was taken."""
        ...

    @property
    def session(self) -> int:
        """Number of this session: 0 for a scan that was begun by it."""
        ...

    @property
    def folder(self) -> Path | None:
        """Where pictures may be put; None where nothing is on the disk."""
        ...

    def keep(self, take: Kept) -> None:
        """Add a take; when this returns it is kept.

        Raises:
            StoreError: it cannot be written.
        """
        ...

    def end(self, state: str) -> None:
        """Write down how the scan ended."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class InMemory:
    """Keeps nothing beyond the program: where a scan is one sample of something else."""

    session = 0
    folder = None

    def __init__(self) -> None:
        self._taken: list[Kept] = []

    @property
    def taken(self) -> tuple[Kept, ...]:
        """See `Keeping.taken`."""
        return tuple(self._taken)

    def keep(self, take: Kept) -> None:
        """See `Keeping.keep`."""
        self._taken.append(take)

    def end(self, state: str) -> None:
        """See `Keeping.end`."""

    def close(self) -> None:
        """See `Keeping.close`."""
