"""Targets in a profile: one closed model per kind, told apart by `kind`."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rig.profile.model import Model, Positive


class CheckerboardConfig(Model):
    """A plain checkerboard; all of it must be in view."""

    kind: Literal["checkerboard"]
    """Selects a checkerboard."""
    columns: int = Field(ge=3, le=1000)
    """Inner corners along the longer side."""
    rows: int = Field(ge=3, le=1000)
    """Inner corners along the shorter side."""
    square_mm: Positive
    """Side of one square."""


class CharucoConfig(Model):
    """A checkerboard with a marker in every white square; any part of it will do to calibrate."""

    kind: Literal["charuco"]
    """Selects a ChArUco board."""
    squares_across: int = Field(ge=3, le=1000)
    """Squares in a row: one more than inner corners."""
    squares_down: int = Field(ge=3, le=1000)
    """Squares in a column."""
    square_mm: Positive
    """Side of one square."""
    marker_mm: Positive
    """Side of a marker with its border."""
    dictionary: str
    """One of OpenCV's predefined dictionaries, such as `4X4_50` or `DICT_5X5_100`."""
    inverted: bool = False
    """Whether the board is printed white on black."""
    legacy_pattern: bool = False
    """Whether it was drawn by OpenCV before 4.6: with an even number of squares down the first
    square then holds a marker."""

    @model_validator(mode="after")
    def _markers_fit(self) -> Self:
        if not self.marker_mm < self.square_mm:
            raise ValueError(
                f"marker_mm is {self.marker_mm}, square_mm {self.square_mm}; markers are smaller"
            )
        return self


class AprilGridConfig(Model):
    """A grid of AprilTags 36h11 as Kalibr prints it; any part of it will do."""

    kind: Literal["aprilgrid"]
    """Selects an AprilGrid."""
    tag_columns: int = Field(ge=1, le=100)
    """Tags in a row: Kalibr's `tagCols`."""
    tag_rows: int = Field(ge=1, le=100)
    """Tags in a column: Kalibr's `tagRows`."""
    tag_mm: Positive
    """Side of a tag with its black border: Kalibr's `tagSize`, which is in metres."""
    spacing: float = Field(gt=0, le=1)
    """Gap between tags over the side of a tag: Kalibr's `tagSpacing`."""
    border_bits: Literal[1, 2] = 2
    """Width of the black border; Kalibr prints 2, other programs 1."""
    first_tag: int = Field(default=0, ge=0)
    """Number of the tag at the bottom left; numbers grow to the right, then upwards."""


class AsymmetricCirclesConfig(Model):
    """Black circles in rows that are shifted in turn, as OpenCV prints them."""

    kind: Literal["asymmetric_circles"]
    """Selects an asymmetric grid of circles; all of it must be in view."""
    columns: int = Field(ge=2, le=1000)
    """Circles in a row."""
    rows: int = Field(ge=3, le=1000)
    """Rows; with an odd number the grid has one way up."""
    spacing_mm: Positive
    """From row to row, half the distance of two circles in a row: OpenCV's `squareSize`."""
    diameter_mm: Positive
    """Of a circle; the middle of its picture is corrected for perspective with it."""


SquaresConfig = CheckerboardConfig | CharucoConfig
"""Targets of squares, whose edges a sweep measures."""
TargetConfig = Annotated[
    CheckerboardConfig | CharucoConfig | AprilGridConfig | AsymmetricCirclesConfig,
    Field(discriminator="kind"),
]
