"""What a capture did, frame by frame."""

from dataclasses import dataclass, field

from rig.capture.spread import SpreadTally
from rig.live.frame import DepthFrame


@dataclass(slots=True)
class CaptureTally:
    """Times and answers of the frames so far; takes the same memory for any number of them."""

    frames: int = 0
    latency_s: SpreadTally = field(default_factory=SpreadTally)
    measuring_s: SpreadTally = field(default_factory=SpreadTally)
    skew_s: SpreadTally = field(default_factory=SpreadTally)
    time_ns: tuple[int, int] | None = None
    """First and last frame by the wall clock."""
    _valid_shares: float = 0.0

    def add(self, frame: DepthFrame) -> None:
        """Count one frame."""
        self.frames += 1
        self.latency_s.add(frame.latency_s)
        self.measuring_s.add(frame.measuring_s)
        self.skew_s.add(frame.views.skew_s)
        first_ns = frame.time_ns if self.time_ns is None else self.time_ns[0]
        self.time_ns = (first_ns, frame.time_ns)
        self._valid_shares += frame.valid_share

    @property
    def valid_pct(self) -> float:
        """Mean share of pixels with an answer, per cent; NaN before the first frame."""
        return 100.0 * self._valid_shares / self.frames if self.frames else float("nan")


def in_words(frame: DepthFrame) -> str:
    """Say for a person how a frame went."""
    valid_pct = 100.0 * frame.valid_share
    return f"answer at {valid_pct:.1f} % of the pixels, {1e3 * frame.latency_s:.0f} ms"
