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


TargetConfig = Annotated[CheckerboardConfig | CharucoConfig, Field(discriminator="kind")]
