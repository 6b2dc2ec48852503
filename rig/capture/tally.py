"""What a capture did, frame by frame."""

import statistics
from dataclasses import dataclass, field

from rig.live.frame import DepthFrame


@dataclass(slots=True)
class CaptureTally:
    """Latency, skew and answers of the frames so far."""

    latencies_s: list[float] = field(default_factory=list)
    skews_s: list[float] = field(default_factory=list)
    valid_shares: list[float] = field(default_factory=list)

    def add(self, frame: DepthFrame) -> None:
        """Count one frame."""
        self.latencies_s.append(frame.latency_s)
        self.skews_s.append(frame.views.skew_s)
        self.valid_shares.append(frame.valid_share)

    @property
    def valid_pct(self) -> float:
        """Mean share of pixels with an answer, per cent; NaN before the first frame."""
        return 100.0 * statistics.fmean(self.valid_shares) if self.valid_shares else float("nan")


def in_words(frame: DepthFrame) -> str:
    """Say for a person how a frame went."""
    valid_pct = 100.0 * frame.valid_share
    return f"answer at {valid_pct:.1f} % of the pixels, {1e3 * frame.latency_s:.0f} ms"
