"""Real pairs without truth, against SGBM-HH on frames whose rows and light have been mended."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.slopes.asked import Asked
from benchmarks.slopes.dino import read_view, shared_folder
from benchmarks.slopes.honesty import told
from benchmarks.slopes.mending import consistent, mended
from rig.epipolar import Label, RectifiedViews, SlopeMap, estimate_slopes

Grey = NDArray[np.uint8]
Map = NDArray[np.float32]

_AGREED_PX, _SURE_PX, _SURE_SIGMAS = 1.0, 1.0, 5.0
_PLANE_RADIUS_PX, _PLANE_ROUNDS, _PLANE_SCALE_PX = 7, 4, 0.7


@dataclass(frozen=True)
class RealPair:
    """A pair as its own calibration rectified it."""

    name: str
    left: Grey
    right: Grey
    range_px: tuple[float, float]
    seen: tuple[slice, slice]
    """Rows and columns of the left picture that the camera saw."""


def real(asked: Asked) -> None:
    """Print how much is answered, and how much of it agrees."""
    print(
        f"{'pair':16} {'rows: px':>15} {'light: levels':>15} {'scored':>6} {'answd':>6} "
        f"{'agree':>6} {'smooth':>6} {'HH own':>6} {'blind':>6} {'differ':>6} {'HH raw':>6} "
        f"{'s':>6}  warnings"
    )
    pairs = list(_pairs())
    if not pairs:
        print("left out: set RIG_SHARED_DATA to the folder that holds oak-d-pairs, jetson-pair")
    for pair in pairs:
        if asked.wants(pair.name):
            _line(pair, asked.pictures)


def _line(pair: RealPair, pictures: Path | None) -> None:
    """Answered: sigma below 1 px, of scored; agree: of those, within 1 px of the reference map.

    Smooth: of those, within 1 px of the local plane of the reference map, and "HH own": how much of
    that map itself is. Differ: of scored, by more than 1 px and 5 sigma. Blind: of all that the
    camera saw.
    """
    right, offset_px, brighter = mended(pair.left, pair.right, pair.range_px)
    raw = consistent(pair.left, pair.right, pair.range_px)[pair.seen]
    reference = consistent(pair.left, right, pair.range_px)
    views = RectifiedViews(np.stack([pair.left, pair.right]), np.array([0.0, 1.0]), np.zeros(2), 0)
    start = time.perf_counter()
    found = estimate_slopes(views, pair.range_px)
    took_s = time.perf_counter() - start
    with np.errstate(invalid="ignore"):
        scored = np.abs(reference[pair.seen] - raw) <= _AGREED_PX
        plane = _local_plane(reference)
        rough_px = np.abs(reference - plane)[pair.seen][scored]
        off_plane_px = np.abs(found.slope_px - plane)[pair.seen][scored]
        off_px = np.abs(found.slope_px - reference)[pair.seen][scored]
        sigma_px = found.sigma_px[pair.seen][scored]
        answered = (found.label[pair.seen][scored] != Label.NONE) & (sigma_px < _SURE_PX)
        differs = (off_px > _AGREED_PX) & (off_px > _SURE_SIGMAS * sigma_px)
    blind = found.label[pair.seen] == Label.NONE
    light = f"{brighter[pair.seen].min():6.1f} ..{brighter[pair.seen].max():6.1f}"
    rows = f"{offset_px[pair.seen].min():6.2f} ..{offset_px[pair.seen].max():6.2f}"
    print(
        f"{pair.name:16} {rows:>15} {light:>15} {_share(scored):6.1f} {_share(answered):6.1f} "
        f"{_share(off_px[answered] <= _AGREED_PX):6.1f} "
        f"{_share(off_plane_px[answered] <= _AGREED_PX):6.1f} "
        f"{_share(rough_px <= _AGREED_PX):6.1f} {_share(blind):6.1f} "
        f"{_share(differs):6.2f} {_share(np.isfinite(raw)):6.1f} {took_s:6.2f}  "
        f"{told(found.warnings)}",
        flush=True,
    )
    if pictures is not None:
        _draw(pictures, pair, found, reference)


def _share(where: NDArray[np.bool_]) -> float:
    return 100.0 * float(where.mean()) if where.size else float("nan")


def _local_plane(slope_px: Map) -> Map:
    """Robust plane through 15 x 15 px of a map around every pixel, read there, (H, W).

    SGBM tells weak texture to a pixel or so only; what lies around tells it better. Weighted least
    squares with a weight that falls with the distance from the last plane.
    """
    known = np.isfinite(slope_px)
    z = np.where(known, slope_px, np.float32(0)).astype(np.float64)
    y, x = np.indices(z.shape).astype(np.float64)
    side = 2 * _PLANE_RADIUS_PX + 1
    weight, plane = known.astype(np.float64), z
    for _ in range(_PLANE_ROUNDS):
        terms = (np.ones_like(z), x, y, x * x, x * y, y * y, z, x * z, y * z)
        sums = [cv2.blur(weight * term, (side, side)) for term in terms]
        whole = np.maximum(sums[0], 1e-12)
        mx, my, xx, xy, yy, mz, xz, yz = (part / whole for part in sums[1:])
        xx, xy, yy = xx - mx * mx + 1e-3, xy - mx * my, yy - my * my + 1e-3
        xz, yz, spread = xz - mx * mz, yz - my * mz, xx * yy - xy * xy
        plane = mz + ((xz * yy - yz * xy) * (x - mx) + (yz * xx - xz * xy) * (y - my)) / spread
        weight = known / (1.0 + ((z - plane) / _PLANE_SCALE_PX) ** 2) ** 2
    return plane.astype(np.float32)


def _draw(folder: Path, pair: RealPair, found: SlopeMap, reference: Map) -> None:
    """The left picture, our slopes, and the reference map; grey is blind."""
    folder.mkdir(parents=True, exist_ok=True)
    sure = np.where(found.sigma_px < _SURE_PX, found.slope_px, np.float32(np.nan))
    parts = [cv2.cvtColor(pair.left, cv2.COLOR_GRAY2BGR)]
    parts += [_coloured(part, pair.range_px) for part in (found.slope_px, sure, reference)]
    path = folder / f"{pair.name.replace(' ', '_')}.png"
    cv2.imwrite(str(path), np.vstack([np.hstack(parts[:2]), np.hstack(parts[2:])]))


def _coloured(slope_px: Map, range_px: tuple[float, float]) -> NDArray[np.uint8]:
    low, high = range_px
    known = np.isfinite(slope_px)
    share = np.clip((np.where(known, slope_px, np.float32(low)) - low) / (high - low), 0.0, 1.0)
    colours = cv2.applyColorMap((255.0 * share).astype(np.uint8), cv2.COLORMAP_TURBO)
    colours[~known] = 128
    return np.asarray(colours, np.uint8)


def _pairs() -> Iterator[RealPair]:
    folder = shared_folder("oak-d-pairs")
    if folder is not None:
        for name in ("desk", "toy", "stairs"):
            left, right = (_read(folder / f"{name}_{side}.png") for side in ("left", "right"))
            yield RealPair(f"oak-d {name}", left, right, (0.0, 96.0), _seen(left))
    folder = shared_folder("jetson-pair")
    if folder is not None:
        left, right = (_read(folder / f"jetson_imx219_{side}.png") for side in ("left", "right"))
        yield RealPair("jetson", left, right, (0.0, 192.0), _seen(left))


def _read(path: Path) -> Grey:
    return read_view(path).astype(np.uint8)


def _seen(image: Grey) -> tuple[slice, slice]:
    """Rows and columns within borders that only repeat their last row or column."""
    out: list[slice] = []
    for axis in (0, 1):
        changes = np.abs(np.diff(image.astype(np.int16), axis=axis)).mean(axis=1 - axis)
        lively = np.flatnonzero(changes > 0.25 * np.median(changes))
        out.append(slice(int(lively[0]) + 1, int(lively[-1]) + 1))
    return out[0], out[1]
