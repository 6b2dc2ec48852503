"""Intrinsics that the user states, where no board and no device tells them."""

from collections.abc import Mapping

from pydantic import Field

from rig.profile.model import Model, Positive


class IntrinsicsConfig(Model):
    """Focal lengths and principal point by a data sheet or an earlier calibration.

    `rig calibrate --from-scene` starts from them: pictures of a scene do not tell focal lengths.
    """

    focal_px: Positive | dict[str, Positive]
    """Focal length in px of the pictures that the profile asks for: of all views, or of each."""
    focal_sigma_pct: float = Field(default=0.5, gt=0.0, le=20.0)
    """How sure it is, 1 sigma, per cent."""
    centre_px: tuple[float, float] | None = None
    """Principal point (x, y) of all views, px; by default the middle of the picture, which is less
    sure."""

    @property
    def by_view(self) -> Mapping[str, float]:
        """Focal lengths by view; empty where one is that of all."""
        return self.focal_px if isinstance(self.focal_px, dict) else {}

    def focal_of(self, view: str) -> float:
        """Return the focal length of a view, px."""
        return self.focal_px[view] if isinstance(self.focal_px, dict) else self.focal_px
