"""What captures do to slopes and depth once they are measured."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from rig.profile.model import Model

_First = Annotated[int, Field(ge=0)]
_Side = Annotated[int, Field(ge=8)]


class ProcessingConfig(Model):
    """What is done to slopes and depth once they are measured; nothing by default."""

    temporal_frames: int = Field(default=0, ge=0, le=1000)
    """How many frames slopes are averaged over where nothing moves, 2 or more; 0 for none."""
    roi_px: tuple[_First, _First, _Side, _Side] | None = None
    """Region of interest: first column and row, width and height. Maps are of its size."""
    fill_px: int = Field(default=0, ge=0, le=1000)
    """Longest hole between two answered pixels of a row or column that is bridged and labelled 4;
    0 for none."""
    decimation: int = Field(default=1, ge=1, le=8)
    """Side of the squares of pixels that become one; 1 for none."""

    @model_validator(mode="after")
    def _makes_sense(self) -> Self:
        if self.temporal_frames == 1:
            raise ValueError("temporal_frames is 1, which averages nothing; give 2 or more, or 0")
        return self

    @property
    def applied(self) -> dict[str, object]:
        """What is done, by its key; nothing that is off."""
        return self.model_dump(mode="json", exclude_defaults=True)
