"""Offers what brings rows together, once, where a capture finds that they do not meet."""

from dataclasses import dataclass

from rig.live.frame import DepthFrame
from rig.profile import Profile
from rig.progress import Tell


@dataclass(slots=True)
class RowsOffer:
    """Looks at every frame, and speaks at most once."""

    profile: Profile
    tell: Tell
    has_spoken: bool = False

    def look(self, frame: DepthFrame) -> None:
        """Speak where the rows of a view had to be mended."""
        mending = frame.slopes.mending
        if self.has_spoken or mending is None or not mending.rows.any:
            return
        self.has_spoken = True
        rows = mending.rows
        worst = int(rows.rms_px.argmax())
        is_of_all = len(rows.rms_px) == len(self.profile.views)
        name = self.profile.views[worst].name if is_of_all else "a view"
        self.tell(
            f"rows do not meet: {name} is {rows.worst[worst]} ({rows.rms_px[worst]:.2f} px rms); "
            "mended in every frame, once and for all by `rig calibrate "
            f"{self.profile.name} --from-scene`, or with a board"
        )
