"""Repeated pictures of the board at rest: what they tell, view by view."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.check.photon_transfer import PhotonTransfer, photon_transfer
from rig.errors import TargetError
from rig.frames import Frame, MultiView
from rig.targets import CornersOrReason, Target, corners_or_reason
from rig.targets.corners import Corners, corner_motion_px


@dataclass(frozen=True, slots=True)
class Exposure:
    """Grey levels of one view, where the board is or, without one, in the whole picture."""

    full_scale: float
    """Grey level of a saturated pixel; all levels below are levels of the image."""
    white: float
    """95th percentile."""
    black: float
    """5th percentile."""
    saturated_share: float
    empty_share: float
    """Share of the pixels at level 0."""


@dataclass(frozen=True, slots=True)
class ViewStills:
    """What repeated pictures of one view tell."""

    view: str
    board: CornersOrReason
    """In the first picture."""
    motion_px: float | None
    """Rms motion of the corners between the first and the last picture of a stop."""
    exposure: Exposure
    noise: PhotonTransfer | None
    exposures_s: tuple[float, ...]
    """All exposure times that the device reported, each once."""
    brightness_change: float
    """Largest departure of a picture's mean from the mean of all, as a share of it."""


def search_board(
    image: NDArray[np.uint8] | NDArray[np.uint16], board: Target | None
) -> CornersOrReason:
    """Return the corners of the board, or the reason why there are none."""
    if board is None:
        return TargetError("the profile has no [target]", advice="add it", reason="no-target")
    return corners_or_reason(image, board)


def measure_stills(
    multiviews: Sequence[MultiView], board: Target | None, *, samples: int
) -> tuple[ViewStills, ...]:
    """Measure every view in repeated pictures of a board at rest.

    Args:
        multiviews: one or more, the first taken as soon as a sweep would begin to; noise needs 3.
        board: what the stage carries, None where the profile does not say.
        samples: multi-views per stop of a sweep; motion counts from the first to the last of them.
    """
    last = min(samples, len(multiviews)) - 1
    return tuple(
        _measure_view([multiview.frames[place] for multiview in multiviews], board, last)
        for place in range(len(multiviews[0].frames))
    )


def _measure_view(frames: Sequence[Frame], board: Target | None, last: int) -> ViewStills:
    images = np.stack([frame.image for frame in frames])
    full_scale = float(frames[0].full_scale)
    corners = search_board(frames[0].image, board)
    later = (
        search_board(frames[last].image, board) if last and isinstance(corners, Corners) else None
    )
    brightness = images.mean(axis=(1, 2), dtype=np.float64)
    return ViewStills(
        view=frames[0].view,
        board=corners,
        motion_px=(
            corner_motion_px(corners, later)
            if isinstance(corners, Corners) and isinstance(later, Corners)
            else None
        ),
        exposure=_exposure(frames[0].image, corners, full_scale),
        noise=photon_transfer(images, full_scale) if len(images) > 2 else None,
        exposures_s=tuple(sorted({f.exposure_s for f in frames if f.exposure_s is not None})),
        brightness_change=float(np.abs(brightness / brightness.mean() - 1.0).max())
        if brightness.mean() > 0.0
        else 0.0,
    )


def _exposure(
    image: NDArray[np.uint8] | NDArray[np.uint16], corners: CornersOrReason, full_scale: float
) -> Exposure:
    levels = image.ravel()
    if isinstance(corners, Corners):
        levels = image[_inside(corners, image.shape)]
    black, white = np.percentile(levels, [5.0, 95.0])
    return Exposure(
        full_scale=full_scale,
        white=float(white),
        black=float(black),
        saturated_share=float((levels >= full_scale).mean()),
        empty_share=float((levels == 0).mean()),
    )


def _inside(corners: Corners, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Mask of the pixels between the outermost corners."""
    xy_px = corners.xy_px
    outline = np.stack([xy_px[0, 0], xy_px[0, -1], xy_px[-1, -1], xy_px[-1, 0]])
    mask = np.zeros(shape, np.uint8)
    cv2.fillConvexPoly(mask, np.round(outline).astype(np.int32), 1)
    return mask.astype(bool)
