"""What a calibration found, how sure it is, and whether to trust it."""

import json
from dataclasses import dataclass

import numpy as np

from rig.arrays import Flags, Float, Index, Number
from rig.errors import ConfigError
from rig.geometry.epipolar_error import EpipolarError
from rig.geometry.lens import LensModel
from rig.geometry.pose import Pose
from rig.geometry.rig_geometry import RigGeometry
from rig.json_codec import Codec

VERSION = 3
"""Of the JSON form."""


@dataclass(frozen=True, slots=True)
class BoardWarp:
    """Bending of the board: height = a X^2 + b X Y + c Y^2 over its plane.

    X and Y run from -1 to 1 over the board's extent; positive heights lie along the board's +z.
    """

    height_mm: Float
    """(3,) of X^2, X Y and Y^2."""
    sigma_mm: Float
    """(3,) 1 sigma each."""
    centre_mm: Float
    """(2,) x and y on the board where X = Y = 0."""
    half_mm: Float
    """(2,) from there to its edge."""

    def bent_mm(self, points_mm: Float) -> Float:
        """Points (N, 3) of the flat board where the bent one has them."""
        x, y = ((points_mm[:, :2] - self.centre_mm) / self.half_mm).T
        bent = points_mm.copy()
        bent[:, 2] += np.stack([x * x, x * y, y * y], axis=1) @ self.height_mm
        return bent


@dataclass(frozen=True, slots=True)
class BoardMotion:
    """How far the board moved between the views of one picture, as the pictures tell."""

    turn_rad: Number
    """1 sigma about each axis through its middle, in a typical picture."""
    shift_mm: Number
    """1 sigma of its middle along each axis."""
    picture_scale: Float
    """(N,) how many times as far it moved in each picture; 0 on the stage."""


@dataclass(frozen=True, slots=True)
class Residuals:
    """What is left of one sighting: found minus projected.

    Where the board moved between the views, it is projected from where this view saw it.
    """

    picture: int
    view: int
    ids: Index
    """(N,) point numbers."""
    xy_px: Float
    """(N, 2) where they were found."""
    residual_px: Float
    """(N, 2)."""
    sigma_px: Float
    """(N,) 1 sigma per coordinate, scaled to what the pictures show."""
    outlier: Flags
    """(N,) points that took no part."""
    held_out_px: Float
    """(N, 2) the same after a solve that has not seen this picture, the board's pose apart."""

    @property
    def rms_px(self) -> float:
        """Root mean square distance of the points that took part; NaN if none did."""
        return rms_px(self.residual_px[~self.outlier])

    @property
    def held_out_rms_px(self) -> float:
        """The same of the held-out residuals."""
        return rms_px(self.held_out_px[~self.outlier])


def rms_px(residual_px: Float) -> float:
    """Root mean square length of (N, 2) residuals; NaN for none."""
    if not len(residual_px):
        return float("nan")
    return float(np.sqrt(np.sum(residual_px**2) / len(residual_px)))


@dataclass(frozen=True, slots=True)
class LensScore:
    """How a lens model does on pictures that it has not seen."""

    lens: LensModel
    rms_px: Number
    """Held-out residuals, root mean square distance."""
    worse_px2: Number
    """Mean square above that of the best model."""
    sem_px2: Number
    """Standard error of that difference over the pictures."""


@dataclass(frozen=True, slots=True)
class DepthError:
    """Error of depth that the calibration alone causes at one distance, k = 2.

    For points found without error and triangulated over all views; relative, in percent.
    """

    distance_mm: Number
    seen_pct: Number
    """Root mean square over the part of the reference view in which boards were seen."""
    picture_pct: Number
    """Over the whole picture, but for corners that no light reaches."""
    worst_pct: Number
    """At the worst place of that, mostly a corner."""


@dataclass(frozen=True, slots=True)
class Reason:
    """One thing that makes a calibration weak."""

    code: str
    """For programs, such as `square-on` or `blurred`."""
    text: str
    """What was found, with numbers, and what to do."""


@dataclass(frozen=True, slots=True)
class PoseAdvice:
    """A pose of the board worth taking next."""

    distance_mm: Number
    """Of the board's centre along the optical axis of the reference view."""
    centre_px: tuple[float, float]
    """Where the board's centre should appear in the reference view."""
    tilt_deg: tuple[float, float]
    """About the picture's x axis and y axis."""
    gain_pct: Number
    """By how much the depth error shrinks with this pose and those before it in the list."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Good, or weak and why."""

    reasons: tuple[Reason, ...]
    """None: good."""
    notes: tuple[str, ...]
    """What cannot be judged from these pictures."""
    poses: tuple[PoseAdvice, ...]
    """Poses that would help most, best first."""

    @property
    def good(self) -> bool:
        """Whether nothing speaks against using it."""
        return not self.reasons

    def __str__(self) -> str:
        return "good" if self.good else "weak because " + "; ".join(r.text for r in self.reasons)


@dataclass(frozen=True, slots=True)
class Calibration:
    """Everything that one solve found."""

    geometry: RigGeometry
    """With its covariance, scaled to what the residuals show, and the stage where one took part."""
    points_mm: Float
    """(P, 3) of the flat target."""
    warp: BoardWarp
    pictures: tuple[int, ...]
    """Numbers of the pictures used, in order."""
    reference_from_board: tuple[Pose, ...]
    """Pose of the board in each of `pictures`, in the frame of the reference view."""
    motion: BoardMotion | None
    """None where all views of a picture agree about the board but for chance."""
    residuals: tuple[Residuals, ...]
    """One per sighting, in the order of picture and view."""
    epipolar: EpipolarError
    lens: LensModel
    lens_scores: tuple[LensScore, ...]
    """Of the models that were compared; one if the model was given."""
    depth_error: tuple[DepthError, ...]
    """At 0.5, 1, 2 and 3 m; none of one view alone, or where a fixed geometry came without
    covariance."""
    error_scale: Number
    """Errors of one picture have something in common: its pull varies so many times as much as
    that of independent errors, 1 at least. Already in the covariance; above 4 the model misses
    something."""
    verdict: Verdict

    @property
    def rms_px(self) -> float:
        """Root mean square reprojection distance of the points that took part."""
        return rms_px(np.concatenate([r.residual_px[~r.outlier] for r in self.residuals]))

    @property
    def held_out_rms_px(self) -> float:
        """The same on pictures that the solve has not seen."""
        return rms_px(np.concatenate([r.held_out_px[~r.outlier] for r in self.residuals]))

    def to_json(self) -> str:
        """Write everything as JSON; floats come back to the bit."""
        return json.dumps({"version": VERSION, "calibration": _JSON.to_json(self)})

    @classmethod
    def from_json(cls, text: str) -> "Calibration":
        """Read what `to_json` wrote.

        Raises:
            ConfigError: the text is no calibration, or of another version.
        """
        try:
            data = json.loads(text)
        except ValueError as error:
            raise ConfigError(
                f"calibration asked for, the text is no JSON: {error}", advice="calibrate again"
            ) from error
        version = data.get("version") if isinstance(data, dict) else None
        if version != VERSION or set(data) != {"version", "calibration"}:
            raise ConfigError(
                f"calibration of version {VERSION} asked for, found version {version}",
                advice="calibrate again, or read it with the version of rig that wrote it",
            )
        return _JSON.from_json(data["calibration"])


_JSON = Codec(
    Calibration, name="calibration", error=ConfigError, advice="calibrate again", finite=False
)
