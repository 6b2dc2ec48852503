"""The message `rig.MultiView`: what Foxglove's schemas have no room for, exactly.

JSON, because it holds every float64 as it is and needs no schema compiler; one message of some
hundred bytes a multi-view.
"""

import json
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field

from rig.frames import MultiView

TOPIC: Final = "/multi_view"
NAME: Final = "rig.MultiView"
_LONGEST_S: Final = 60.0
"""Longer than the views of one multi-view can be apart, or an exposure can take."""
_MOST: Final = 1 << 63

_Seconds = Annotated[float, Field(ge=0.0, le=_LONGEST_S, allow_inf_nan=False)]


class FrameFacts(BaseModel):
    """Facts of one frame; see `rig.frames.Frame`."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    view: Annotated[str, Field(min_length=1, max_length=200)]
    timestamp_s: Annotated[float, Field(ge=-1e10, le=1e10, allow_inf_nan=False)]
    sequence: Annotated[int, Field(gt=-_MOST, lt=_MOST)]
    exposure_s: _Seconds | None
    bits: Annotated[int, Field(ge=1, le=16)] | None
    uncertainty_s: _Seconds


class MultiViewFacts(BaseModel):
    """Facts of one multi-view; see `rig.frames.MultiView`."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    temperature_degc: Annotated[float, Field(ge=-300.0, le=1e4, allow_inf_nan=False)] | None
    frames: Annotated[list[FrameFacts], Field(min_length=1, max_length=1000)]
    time_ns: Annotated[int, Field(ge=0, lt=_MOST)] | None = None
    """Mid-exposure, UTC; None in recordings of old."""

    @property
    def views(self) -> tuple[str, ...]:
        """Names of the views in their order."""
        return tuple(frame.view for frame in self.frames)

    @property
    def span_s(self) -> float:
        """Time between the first and the last frame."""
        times_s = [frame.timestamp_s for frame in self.frames]
        return max(times_s) - min(times_s)

    @property
    def is_one_instant(self) -> bool:
        """Whether the frames can be of one multi-view."""
        return self.span_s <= _LONGEST_S and len(set(self.views)) == len(self.views)


def index_message(multiview: MultiView, time_ns: int) -> bytes:
    """Return the message of one multi-view."""
    content: dict[str, object] = {
        "time_ns": time_ns,
        "temperature_degc": multiview.temperature_degc,
        "frames": [
            {name: getattr(frame, name) for name in FrameFacts.model_fields}
            for frame in multiview.frames
        ],
    }
    return json.dumps(content).encode()


def index_schema() -> bytes:
    """Return the JSON schema of the message."""
    return json.dumps(MultiViewFacts.model_json_schema() | {"title": NAME}).encode()
