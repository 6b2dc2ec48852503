"""The target seen by one camera at one instant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Sighting:
    """Points of the target seen in one view at one instant; partial boards are welcome."""

    picture: int
    """Number of the instant; all views of one grab share it, and numbers grow with time."""
    view: int
    """Index of the view in the rig."""
    ids: NDArray[np.intp]
    """(N,) point numbers on the target, each at most once."""
    xy_px: Float
    """(N, 2) where they were found."""
    sigma_px: Float
    """(N,) 1 sigma per coordinate; what counts is the ratio between the points of a view."""

    def __post_init__(self) -> None:
        ids = np.ascontiguousarray(self.ids, np.intp).reshape(-1)
        xy_px = np.ascontiguousarray(self.xy_px, np.float64).reshape(-1, 2)
        sigma_px = np.ascontiguousarray(self.sigma_px, np.float64).reshape(-1)
        if not (len(ids) == len(xy_px) == len(sigma_px)):
            raise ConfigError(
                f"picture {self.picture} of view {self.view}: {len(ids)} ids, {len(xy_px)} "
                f"positions and {len(sigma_px)} sigmas given",
                advice="give one of each per point",
            )
        if len(np.unique(ids)) != len(ids) or (ids < 0).any():
            raise ConfigError(
                f"picture {self.picture} of view {self.view}: a point number is negative or "
                "there twice",
                advice="give every point of the target once",
            )
        if not (np.isfinite(xy_px).all() and np.isfinite(sigma_px).all() and (sigma_px > 0).all()):
            raise ConfigError(
                f"picture {self.picture} of view {self.view}: positions must be finite and "
                "sigmas positive",
                advice="leave out points that were not found",
            )
        for name, value in (("ids", ids), ("xy_px", xy_px), ("sigma_px", sigma_px)):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.ids)
