"""What is on a sheet of paper, in mm from its top left corner."""

from dataclasses import dataclass
from typing import Literal

Ink = Literal["black", "white"]


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle with sides along the paper's."""

    x_mm: float
    y_mm: float
    width_mm: float
    height_mm: float


@dataclass(frozen=True, slots=True)
class Disc:
    """A round one, by its middle."""

    x_mm: float
    y_mm: float
    radius_mm: float


@dataclass(frozen=True, slots=True)
class Area:
    """Shapes that do not overlap, painted as one: no seam shows where they touch."""

    ink: Ink
    rects: tuple[Rect, ...]
    discs: tuple[Disc, ...] = ()


@dataclass(frozen=True, slots=True)
class Line:
    """One line of text, black, in ASCII."""

    x_mm: float
    """Left end."""
    y_mm: float
    """Base line."""
    height_mm: float
    """Of the font."""
    text: str


@dataclass(frozen=True, slots=True)
class Drawing:
    """A sheet; areas are painted in order, text last."""

    width_mm: float
    height_mm: float
    areas: tuple[Area, ...]
    lines: tuple[Line, ...]
    title: str
