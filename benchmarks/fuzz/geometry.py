"""A calibration to be written in every format: the truth of a simulated rig."""

from rig_sim.clock import VirtualClock
from rig_sim.world import World

from rig.geometry.rig_geometry import RigGeometry
from rig.profile.load import load_profile
from tests.support.cameras import Slide
from tests.support.geometry import true_geometry


def known_geometry() -> RigGeometry:
    """Return five cameras with lenses that distort, and a stage."""
    profile = load_profile("sim-real", ("world.renderer=analytic",))
    world = World(profile, clock=VirtualClock(), carriage=Slide(), scene="board")
    return true_geometry(profile, world.moment(0.0))
