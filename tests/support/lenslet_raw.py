"""Raw pictures of a lenslet camera, from the closed form of the simulated array."""

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rig_sim.lenslets.array import TrueArray

from rig.lenslet.array import LensletArray, fit_array
from rig.lenslet.lattice import LatticeKind
from rig.lenslet.white import RawFormat

DARK, FULL, WHITE = 64, 4095, 3000.0
COLOURS = np.array([[0.6, 1.0], [0.9, 0.5]])


def true_array(
    lattice: LatticeKind = "hexagonal",
    size_px: tuple[int, int] = (420, 320),
    rotation_deg: float = 2.0,
    **changes: Any,
) -> TrueArray:
    """An array whose micro-images nearly touch, with a cat's eye."""
    array = TrueArray(
        lattice,
        *size_px,
        spacing_px=14.0,
        rotation_rad=math.radians(rotation_deg),
        offset_px=(0.3, -0.2),
        g_over_b=0.01,
        aperture_px=6.4,
        falloff=0.3,
    )
    return replace(array, **changes)


def without_some(array: TrueArray, share: float) -> TrueArray:
    """The array with a share of its lenslets dark, drawn at random."""
    i, j = np.meshgrid(np.arange(-150, 150), np.arange(-150, 150))
    gone = np.random.default_rng(5).random(i.shape) < share
    return replace(array, missing=frozenset(zip(i[gone].tolist(), j[gone].tolist(), strict=True)))


def exposed(
    light: NDArray[np.float64], *, is_bayer: bool = False, noise: float = 0.0
) -> NDArray[np.uint16]:
    """Grey values of light (H, W), 1 = `WHITE` above `DARK`."""
    rows, columns = light.shape
    if is_bayer:
        light = light * np.tile(COLOURS, (rows // 2 + 1, columns // 2 + 1))[:rows, :columns]
    light = light + noise * np.random.default_rng(3).standard_normal(light.shape)
    return np.clip(np.rint(WHITE * light + DARK), 0, FULL).astype(np.uint16)


def raw_format(*, is_bayer: bool = False) -> RawFormat:
    """Of `exposed`."""
    return RawFormat(FULL, is_bayer, float(DARK))


@lru_cache(maxsize=4)
def fitted(
    lattice: LatticeKind = "hexagonal", is_bayer: bool = False
) -> tuple[TrueArray, LensletArray]:
    """A small array, and what its white picture tells of it."""
    truth = true_array(lattice, (320, 240))
    white = exposed(truth.white(), is_bayer=is_bayer)
    return truth, fit_array(white, raw_format(is_bayer=is_bayer), lattice, 14.2)[0]


def in_images(truth: TrueArray) -> tuple[NDArray[np.float64], ...]:
    """Light of white, and places of all pixels in their micro-images along and across the rows."""
    x, y = truth.pixels()
    i, j = truth.cells(x, y)
    away = np.stack([x, y], axis=-1) - truth.centres_px(i, j)
    cos, sin = math.cos(truth.rotation_rad), math.sin(truth.rotation_rad)
    light = truth.passed(x, y, i, j)
    return light, away @ np.array([cos, sin]), away @ np.array([-sin, cos])
