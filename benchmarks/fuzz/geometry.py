"""A calibration to be written in every format: the truth of a simulated rig."""

from dataclasses import replace

from rig_sim.clock import VirtualClock
from rig_sim.world import World

from rig.geometry.lens import COEFFICIENTS, LensModel
from rig.geometry.rig_geometry import RigGeometry
from rig.profile.load import load_profile
from tests.support.cameras import Slide
from tests.support.geometry import true_geometry


def known_geometry() -> RigGeometry:
    """Return five cameras with lenses that distort, and a stage."""
    profile = load_profile("sim-real", ("world.renderer=analytic",))
    world = World(profile, clock=VirtualClock(), carriage=Slide(), scene="board")
    return true_geometry(profile, world.moment(0.0))


def some_of(geometry: RigGeometry, count: int) -> RigGeometry:
    """Return the reference and the views behind it, so many."""
    at = [geometry.reference, *(i for i in range(len(geometry.names)) if i != geometry.reference)]
    kept = at[:count]
    return RigGeometry(
        tuple(geometry.names[i] for i in kept),
        0,
        tuple(geometry.cameras[i] for i in kept),
        tuple(geometry.cam_from_reference[i] for i in kept),
    )


def lens_of(geometry: RigGeometry, lens: LensModel) -> RigGeometry:
    """Return the same rig with small distortions of another kind."""
    numbers = tuple(0.01 * (-1.0) ** i / (1 + i) for i in range(COEFFICIENTS[lens]))
    cameras = tuple(replace(c, lens=lens, coefficients=numbers) for c in geometry.cameras)
    return replace(geometry, cameras=cameras)


def sized(geometry: RigGeometry, width_px: int, height_px: int) -> RigGeometry:
    """Return the same rig with pictures of another size."""
    cameras = (replace(c, width_px=width_px, height_px=height_px) for c in geometry.cameras)
    return replace(geometry, cameras=tuple(cameras))
