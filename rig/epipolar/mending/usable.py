"""Which views say something: a dead, covered, frozen or doubled one is left out, with a warning."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig.epipolar.views import Image, RectifiedViews
from rig.errors import SlopeError

_STRANGE, _FAMILIAR = 0.4, 0.5
"""A view is left out where it agrees with the reference less than this share of what the best view
reaches, if that reaches the second number."""
_ALIKE, _ALIKE_OF_FEW, _FEW = 0.25, 0.02, 3
"""A view shows the same picture as the reference where it differs by less than this share of what
the others make expect. Between a right view and a copy that was compressed again lies a factor of
four; where fewer than three others are there to ask, one that is wrong itself may mislead by more.
"""
_SATURATED_SHARE = 0.02
_SAMPLE_PX = 5


def saturation_grey(images: Image) -> float:
    """Grey value at which pixels are clipped; infinite where hardly any are."""
    return _saturation(np.ascontiguousarray(images[:, ::_SAMPLE_PX, ::_SAMPLE_PX]))


def _saturation(sample: NDArray[np.integer | np.floating]) -> float:
    top = sample.max()
    return float(top) if float((sample == top).mean()) > 0.1 * _SATURATED_SHARE else float("inf")


def seen_views(views: RectifiedViews) -> tuple[RectifiedViews, tuple[str, ...]]:
    """Leave out views without any picture in them; say which, and whether pixels are clipped.

    Raises:
        SlopeError: values are not finite, or fewer than two views show anything.
    """
    images = views.images
    if images.dtype == np.float32 and not np.isfinite(images).all():
        raise SlopeError(
            "found values that are not finite in the images", advice="give finite grey values"
        )
    warnings: tuple[str, ...] = ()
    sample = np.ascontiguousarray(images[:, ::_SAMPLE_PX, ::_SAMPLE_PX])
    spread = sample.reshape(len(sample), -1).std(axis=1)
    clipped = np.count_nonzero(sample >= _saturation(sample)) / sample.size
    if clipped > _SATURATED_SHARE and spread[views.reference] > 0:
        warnings = (
            f"{100 * clipped:.0f} % of the pixels are saturated, say nothing; lower the exposure",
        )
    dark = spread < 0.02 * float(np.median(spread)) + 1e-12
    dark &= spread < 0.5 * spread[views.reference]
    if int((~dark).sum()) < 2:
        raise SlopeError(
            f"only {int((~dark).sum())} of {len(dark)} views show anything",
            advice="look for covered or dead cameras",
        )
    doubled = _doubled(views, sample.reshape(len(sample), -1).astype(np.float32), dark)
    reasons = {int(i): f"shows nothing (grey spread {spread[i]:.2g})" for i in np.flatnonzero(dark)}
    reasons |= dict.fromkeys(
        map(int, np.flatnonzero(doubled)),
        "shows the same picture as the reference (one camera opened twice? swapped cables?)",
    )
    if not reasons:
        return views, warnings
    return keep(views, ~(dark | doubled)), warnings + _left_out(views, reasons)


def _doubled(
    views: RectifiedViews, grey: NDArray[np.float32], dark: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Tell the views that show the picture of the reference once more, (V,).

    By what a gain and an offset leave between the two. How much that is for a right view, the
    others tell: no less than in proportion to how far the baseline moves the texture (a view close
    by, or one that moves along stripes, differs by little or nothing), and where all are alike (no
    texture, no noise and slope 0), none is named.
    """
    reference = views.reference
    grey = grey - grey.mean(axis=1, keepdims=True)
    own = float(grey[reference] @ grey[reference])
    shared = (grey @ grey[reference]) ** 2 / np.maximum(
        np.einsum("vn,vn->v", grey, grey), np.float32(1e-9)
    )
    apart = np.sqrt(np.maximum(own - shared.astype(np.float64), 1e-9 * own))
    moved = _moved_texture(views)
    doubled = np.zeros(len(grey), np.bool_)
    useful = np.flatnonzero(~dark & (np.arange(len(grey)) != reference))
    for i in useful:
        others = useful[useful != i]
        if len(others):
            share = np.minimum(1.0, moved[i] / np.maximum(moved[others], 1e-12))
            expected = float(np.median(apart[others] * share))
            doubled[i] = apart[i] < (_ALIKE if len(others) >= _FEW else _ALIKE_OF_FEW) * expected
    return doubled


def _moved_texture(views: RectifiedViews) -> NDArray[np.float64]:
    """Change of the grey values by one px of slope, rms, for the baseline of every view, (V,)."""
    picture = views.images[views.reference]
    if views.is_colour:
        picture = picture[..., 1]
    if min(views.shape) < 2:
        return np.zeros(len(views.images))
    inner = picture[:-1, :-1][::_SAMPLE_PX, ::_SAMPLE_PX].astype(np.float64)
    right = picture[:-1, 1:][::_SAMPLE_PX, ::_SAMPLE_PX] - inner
    down = picture[1:, :-1][::_SAMPLE_PX, ::_SAMPLE_PX] - inner
    x, y = views.x_steps, views.y_steps
    square = (right**2).mean() * x**2 + (down**2).mean() * y**2
    square += 2.0 * (right * down).mean() * x * y
    return np.sqrt(np.maximum(square, 0.0))


def strange_views(
    views: RectifiedViews, agreement: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Tell the views that show another scene than the reference, (V,), and say so.

    Where no view agrees (a hypothesis that is wrong everywhere), nothing can be told.
    """
    others = np.arange(len(agreement)) != views.reference
    best = float(agreement[others].max())
    strange = others & (agreement < _STRANGE * best)
    if best < _FAMILIAR or not strange.any():
        return np.zeros_like(strange), ()
    reasons = {
        int(i): f"agrees with the reference by {agreement[i]:.2f}, the best view by {best:.2f} (a "
        "frozen picture? a wrong position?)"
        for i in np.flatnonzero(strange)
    }
    return strange, _left_out(views, reasons)


def moving_views(
    views: RectifiedViews, frozen: tuple[int, ...]
) -> tuple[RectifiedViews, tuple[str, ...]]:
    """Leave out views that are known to show an old picture; say which.

    Raises:
        SlopeError: the reference is one of them, or fewer than two views are left.
    """
    if not frozen:
        return views, ()
    kept = ~np.isin(np.arange(len(views.images)), frozen)
    if not kept[views.reference] or int(kept.sum()) < 2:
        raise SlopeError(
            f"views {', '.join(map(str, frozen))} repeat their last picture bit for bit while "
            f"others change, the reference is view {views.reference}",
            advice="restart the camera",
        )
    return keep(views, kept), _left_out(views, dict.fromkeys(frozen, "repeats its last picture"))


def keep(views: RectifiedViews, kept: NDArray[np.bool_]) -> RectifiedViews:
    """Return some of the views; the reference must be among them."""
    return replace(
        views,
        images=views.images[kept],
        x_steps=views.x_steps[kept],
        y_steps=views.y_steps[kept],
        reference=int(kept[: views.reference].sum()),
        beside_px=None if views.beside_px is None else views.beside_px[kept],
        mending=None if views.mending is None else views.mending.kept(kept),
        row_errors=None if views.row_errors is None else views.row_errors.kept(kept),
    )


def _left_out(views: RectifiedViews, reasons: dict[int, str]) -> tuple[str, ...]:
    return tuple(
        f"view {i} at ({views.x_steps[i]:g}, {views.y_steps[i]:g}) {reason}; it was left out"
        for i, reason in reasons.items()
    )
