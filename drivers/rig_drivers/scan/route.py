"""The way of a scan: which takes there are, in which order, and where each one is."""

from collections.abc import Sequence
from dataclasses import dataclass

from rig.profile import ScanCameraConfig
from rig.profile.scan_camera import REFERENCE


@dataclass(frozen=True, slots=True)
class Halt:
    """One take that is planned."""

    view: str
    role: str
    """`view`, `first`, `again` or `last`, see `rig.scan.Take`."""
    places_mm: tuple[float, ...]
    """Where each carrier goes: that of the row, then that of the column."""


def route(config: ScanCameraConfig) -> tuple[Halt, ...]:
    """Return the takes of a whole scan: reference, row, column, reference.

    The row runs from one end to the other, so that its reference view lies in the middle of the
    time; so does the column.
    """
    paths = (config.row, config.column)
    home_mm = tuple(path.reference_mm for path in paths if path is not None)
    halts = [Halt(REFERENCE, "first", home_mm)]
    halts += [Halt(name, "view", (mm, *home_mm[1:])) for name, mm in config.row.named("h")]
    for name, place_mm in config.column.named("v") if config.column else ():
        role = "again" if name == REFERENCE else "view"  # the row has it as a view
        halts.append(Halt(name, role, (home_mm[0], place_mm)))
    return (*halts, Halt(REFERENCE, "last", home_mm))


def still_to_take(halts: Sequence[Halt], taken: Sequence[Halt]) -> tuple[Halt, ...]:
    """Return what is missing of a scan; one that was begun looks at its reference first, again."""
    left = tuple(halt for halt in halts if halt not in taken)
    if not taken or not left:
        return left
    return (Halt(REFERENCE, "again", halts[0].places_mm), *left)
