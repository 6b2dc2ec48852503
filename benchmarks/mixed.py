"""Unlike cameras: what the middle view of `sim-mixed` adds to its outer pair, against the truth.

`python -m benchmarks.mixed [SCALE]` renders the desk with the cameras of the profile `sim-mixed`
(1280 x 800, 1920 x 1080 with another lens between them, 1280 x 800; SCALE makes all of them
smaller) and measures slopes with all three views, seen from the middle one, and with the outer pair
alone, seen from the left. Only what lies inside all three pictures counts. Printed: the share of
pixels with an answer, of all and of those that something nearer hides from a view; median sigma of
depth; robust spread of error over sigma; and the share of answers that are wrong by more than 1 px
of the outer pair's disparity.
"""

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rig_sim.camera import SimCamera
from rig_sim.clock import VirtualClock
from rig_sim.scenes.catalogue import static_shapes
from rig_sim.surface import cast
from rig_sim.world import Moment, World

from rig.arrays import Float
from rig.epipolar import SlopeMap, estimate_slopes
from rig.frames import GreyImage
from rig.geometry.rectification import Rectification, rectify
from rig.geometry.rig_geometry import RigGeometry
from rig.optics.calibrated import CalibratedOptics
from rig.profile import Profile, SimCameraConfig
from rig.profile.load import load_profile
from tests.support.cameras import Slide
from tests.support.geometry import true_geometry

OUTER = (0, 2)
_WRONG_PX = 1.0
_HIDDEN_MM = 5.0
"""What lies so far behind the surface that a view sees there is hidden from it."""


def main() -> None:
    profile = smaller(load_profile("sim-mixed"), float(sys.argv[1]) if len(sys.argv) > 1 else 1.0)
    world = World(profile, clock=VirtualClock(), carriage=Slide(), scene="desk")
    with SimCamera(camera_of(profile), world) as camera:
        images = camera.grab(5.0).images
    moment = world.moment(0.0)
    whole = true_geometry(profile, moment)
    outer_px = whole.cameras[0].fx_px * 2.0  # disparity of the pair per view step over depth
    for name, chosen, reference in (("three views", (0, 1, 2), 1), ("outer pair", OUTER, 0)):
        geometry = part_of(whole, chosen, reference)
        trial = measured(profile, geometry, [images[view] for view in chosen])
        print(f"{name}: {trial.scores(moment, reference, chosen, outer_px)}", flush=True)


def camera_of(profile: Profile) -> SimCameraConfig:
    if not isinstance(profile.camera, SimCameraConfig):
        raise TypeError(f"camera {profile.camera.kind} given, sim needed")
    return profile.camera


def smaller(profile: Profile, scale: float) -> Profile:
    """The rig with its pixels 1 / scale times as large."""
    camera, world, range_px = camera_of(profile), profile.world, profile.slopes.range_px
    if world is None or range_px is None:
        raise TypeError("a profile without a world or a range given")
    sizes = {v: (round(w * scale), round(h * scale)) for v, (w, h) in camera.sizes_px.items()}
    errors = {
        name: one.model_copy(update={"focal_px": one.focal_px and one.focal_px * scale})
        for name, one in world.view_errors.items()
    }
    optics = world.optics.model_copy(update={"focal_px": world.optics.focal_px * scale})
    low_px, high_px = range_px
    return profile.model_copy(
        update={
            "camera": camera.model_copy(update={"sizes_px": sizes}),
            "world": world.model_copy(update={"view_errors": errors, "optics": optics}),
            "slopes": profile.slopes.model_copy(
                update={"range_px": (low_px * scale, high_px * scale)}
            ),
        }
    )


def part_of(whole: RigGeometry, chosen: tuple[int, ...], reference: int) -> RigGeometry:
    """Some views of a rig, in the frame of one of them."""
    from_reference = whole.cam_from_reference[reference].inverse()
    return RigGeometry(
        tuple(whole.names[view] for view in chosen),
        chosen.index(reference),
        tuple(whole.cameras[view] for view in chosen),
        tuple(whole.cam_from_reference[view] @ from_reference for view in chosen),
    )


@dataclass(frozen=True, slots=True)
class Trial:
    """Slopes of some views of the rig."""

    rectification: Rectification
    slopes: SlopeMap

    def scores(
        self, moment: Moment, reference: int, chosen: tuple[int, ...], outer_px: float
    ) -> str:
        """Return how good they are, in words."""
        points_mm = seen_points_mm(moment, self.rectification, reference)
        depth_mm = self.depth_of(points_mm, moment, reference)
        a_px_mm = self.rectification.camera.fx_px * self.rectification.pitch_mm
        whole_px = self.slopes.slope_px + self.rectification.infinity_px
        truth_px = a_px_mm / depth_mm
        inside, hidden = zip(*(shown(moment, points_mm, view) for view in range(3)), strict=True)
        counted = np.logical_and.reduce(inside) & np.isfinite(depth_mm)
        of_pair = np.array([hidden[view] for view in chosen])
        beside = counted & np.array(hidden)[list(OUTER)].any(axis=0)
        answered = np.isfinite(self.slopes.slope_px)
        both = counted & answered
        error_px = (whole_px - truth_px)[both]
        plain = both & ~np.array(hidden).any(axis=0)
        ratio = (np.abs(whole_px - truth_px) / self.slopes.sigma_px)[plain]
        # One view step of this frame in px of the outer pair's disparity.
        wrong = np.abs(error_px) * outer_px / self.rectification.camera.fx_px > _WRONG_PX
        twice = beside & ((~of_pair).sum(axis=0) >= 2)
        return (
            f"answered {100 * answered[counted].mean():.1f} %, {100 * answered[beside].mean():.1f} "
            f"% beside edges ({100 * twice.sum() / max(beside.sum(), 1):.0f} % of it in two views);"
            f" sigma {100 * np.median((self.slopes.sigma_px / truth_px)[plain]):.3f} % of depth,"
            f" error over sigma {1.4826 * np.median(ratio):.2f}, wrong by over {_WRONG_PX:.0f} px "
            f"{100 * wrong.mean():.2f} %; of all pixels "
            f"{100 * wrong.sum() / counted.sum():.2f} %"
        )

    def depth_of(self, points_mm: Float, moment: Moment, reference: int) -> Float:
        """(H, W) depth along the common frame's z."""
        camera = moment.cameras[reference]
        away = (points_mm - np.asarray(camera.position_mm)) @ camera.rotation
        return away @ self.rectification.common_from_reference[2]


def measured(profile: Profile, geometry: RigGeometry, images: list[GreyImage]) -> Trial:
    rectification = rectify(geometry, profile.pitch_mm)
    views = CalibratedOptics(rectification, None).views(images)
    reference_px = true_focal_px(profile)
    low_px, high_px = profile.slopes.range_px or (0.0, 0.0)
    ratio = rectification.camera.fx_px / reference_px
    return Trial(rectification, estimate_slopes(views, (low_px * ratio, high_px * ratio)))


def true_focal_px(profile: Profile) -> float:
    return 0.0 if profile.world is None else profile.world.optics.focal_px


def seen_points_mm(moment: Moment, rectification: Rectification, reference: int) -> Float:
    """(H, W, 3) what every rectified pixel of the reference view shows; infinite for nothing."""
    camera = moment.cameras[reference]
    height, width = rectification.shape
    x, y = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    centre_x, centre_y = rectification.centre_px
    focal_px = rectification.camera.fx_px
    common = np.stack([(x - centre_x) / focal_px, (y - centre_y) / focal_px, np.ones_like(x)], -1)
    rays = common @ rectification.common_from_reference @ camera.rotation.T
    origin_mm = np.asarray(camera.position_mm)
    along = cast(list(static_shapes(moment.scene)), origin_mm, rays)[0]
    return origin_mm + np.where(np.isfinite(along), along, np.nan)[..., None] * rays


def shown(
    moment: Moment, points_mm: Float, view: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether points (H, W, 3) lie inside the picture of a view, and whether they are hidden."""
    camera = moment.cameras[view]
    with np.errstate(invalid="ignore"):
        x, y = np.moveaxis(camera.pixels(points_mm), -1, 0)
        inside = (x >= 0) & (x <= camera.width_px - 1) & (y >= 0) & (y <= camera.height_px - 1)
    origin_mm = np.asarray(camera.position_mm)
    away = np.nan_to_num(points_mm - origin_mm, nan=1.0)
    length_mm = np.linalg.norm(away, axis=-1)
    first = cast(list(static_shapes(moment.scene)), origin_mm, away / length_mm[..., None])[0]
    return inside, first < length_mm - _HIDDEN_MM


if __name__ == "__main__":
    main()
