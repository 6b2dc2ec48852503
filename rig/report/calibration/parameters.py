"""Every number of a calibration with its expanded uncertainty."""

from dataclasses import dataclass

import numpy as np

from rig.geometry.lens import LensModel
from rig.geometry.rig_geometry import RigGeometry
from rig.report.numbers import UNKNOWN, digits, with_sigma

_BROWN = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_FISHEYE = ("k1", "k2", "k3", "k4")


@dataclass(frozen=True, slots=True)
class ParameterRow:
    """One parameter over all views, as text."""

    name: str
    unit: str
    values: tuple[str, ...]
    """One per view; a dash where a view has none."""


def parameter_rows(geometry: RigGeometry) -> list[ParameterRow]:
    """Intrinsics and places of all views: value ± 2 sigma, or the value alone if unknown."""
    sigmas = None if geometry.covariance is None else np.sqrt(np.diag(geometry.covariance))
    columns = [_of_view(geometry, view, sigmas) for view in range(len(geometry.names))]
    keys = list(dict.fromkeys(key for column in columns for key in column))
    return [
        ParameterRow(name, unit, tuple(column.get((name, unit), UNKNOWN) for column in columns))
        for name, unit in keys
    ]


def _of_view(
    geometry: RigGeometry, view: int, sigmas: np.ndarray | None
) -> dict[tuple[str, str], str]:
    counts = [4 + len(camera.coefficients) for camera in geometry.cameras]
    camera, pose = geometry.cameras[view], geometry.cam_from_reference[view]
    start = sum(counts[:view])
    values = [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.coefficients]
    names = [("fx", "px"), ("fy", "px"), ("cx", "px"), ("cy", "px")]
    names += [(name, "") for name in _coefficient_names(camera.lens)]
    places = list(range(start, start + len(values)))
    if view != geometry.reference:
        values += [*np.degrees(pose.rotation_rad).tolist(), *pose.translation_mm.tolist()]
        names += [(f"turn {axis}", "°") for axis in "xyz"] + [(f"t{axis}", "mm") for axis in "xyz"]
        order = view - (view > geometry.reference)
        first = sum(counts) + 6 * order
        places += list(range(first, first + 6))
    column: dict[tuple[str, str], str] = {}
    for (name, unit), value, place in zip(names, values, places, strict=True):
        if sigmas is None:
            column[name, unit] = digits(value, 6)
        else:
            sigma = float(sigmas[place])
            column[name, unit] = with_sigma(
                value, float(np.degrees(sigma)) if unit == "°" else sigma
            )
    return column


def _coefficient_names(lens: LensModel) -> tuple[str, ...]:
    match lens:
        case "none":
            return ()
        case "brown5":
            return _BROWN[:5]
        case "brown8":
            return _BROWN
        case "fisheye":
            return _FISHEYE
