"""The JSON column of a measurement: everything about it that no query asks for."""

from collections.abc import Mapping
from dataclasses import dataclass

from rig.errors import StoreError
from rig.geometry.epipolar_error import EpipolarError
from rig.json_codec import Codec
from rig.measurement import Measurement, Point


@dataclass(frozen=True, slots=True)
class Details:
    """The fields of the column; each may be missing, as older versions wrote fewer."""

    edge_pixels: int | None = None
    residual_levels: float | None = None
    track_residual_px: float | None = None
    views: tuple[str, ...] = ()
    epipolar_px: tuple[float, float, float] | None = None
    """Mean, 95th percentile and largest."""
    plane_sigma: tuple[float, float, float] | None = None
    corners_px: tuple[tuple[Point, ...], ...] | None = None
    """The first versions wrote an empty list where they knew none."""
    outline_px: tuple[Point, ...] | None = None
    across_px: tuple[tuple[float, ...], ...] | None = None
    size_px: tuple[int, int] | None = None
    dense_pixel_sigma_px: float | None = None

    @property
    def epipolar(self) -> EpipolarError | None:
        """The same by name."""
        return None if self.epipolar_px is None else EpipolarError(*self.epipolar_px)


_JSON = Codec(Details, name="measurement", error=StoreError, advice="run rig fit on its sweep")


def details_json(measurement: Measurement) -> dict[str, object]:
    """Return the column of a measurement; what is unknown is left out."""
    epipolar = measurement.epipolar
    content = _JSON.to_json(
        Details(
            edge_pixels=measurement.edge_pixels,
            residual_levels=measurement.residual_levels,
            track_residual_px=measurement.track_residual_px,
            views=measurement.views,
            epipolar_px=epipolar and (epipolar.mean_px, epipolar.p95_px, epipolar.max_px),
            plane_sigma=measurement.plane_sigma,
            corners_px=measurement.corners_px,
            outline_px=measurement.outline_px,
            across_px=measurement.across_px,
            size_px=measurement.size_px,
            dense_pixel_sigma_px=measurement.dense_pixel_sigma_px,
        )
    )
    return {name: value for name, value in content.items() if value not in (None, [])}


def read_details(column: Mapping[str, object]) -> Details:
    """Read the column.

    Raises:
        StoreError: it holds something else.
    """
    return _JSON.from_json(dict(column))
