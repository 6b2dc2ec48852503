"""Points of a scene that the reference and other views show, picture by picture."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.arrays import Flags, Float, Index


@dataclass(frozen=True, slots=True)
class SceneFeatures:
    """N features; each is seen by the reference and by at least one other view."""

    picture: Index
    """(N,) which multi-view shows it."""
    reference_px: Float
    """(N, 2) pixel (x, y) of the reference's raw picture."""
    view_px: Float
    """(N, V, 2) pixel of every view's raw picture; NaN where a view does not show it, and in the
    reference."""
    sigma_px: Float
    """(N, V) 1 sigma of each of its coordinates, up to a common factor."""

    def __len__(self) -> int:
        return len(self.reference_px)

    def __getitem__(self, chosen: Flags) -> "SceneFeatures":
        return SceneFeatures(
            self.picture[chosen],
            self.reference_px[chosen],
            self.view_px[chosen],
            self.sigma_px[chosen],
        )

    @property
    def seen(self) -> Flags:
        """(N, V) which views show which feature, the reference left out."""
        return np.isfinite(self.view_px[..., 0])

    @property
    def shared(self) -> Flags:
        """(N,) features that a view besides the reference shows."""
        return np.asarray(self.seen.any(axis=1), np.bool_)

    @classmethod
    def joined(cls, parts: Sequence["SceneFeatures"]) -> "SceneFeatures":
        """Return those of several pictures as one; at least one part is needed."""
        return cls(
            np.concatenate([one.picture for one in parts]),
            np.concatenate([one.reference_px for one in parts]),
            np.concatenate([one.view_px for one in parts]),
            np.concatenate([one.sigma_px for one in parts]),
        )
