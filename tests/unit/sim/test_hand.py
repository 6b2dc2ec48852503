import numpy as np
import pytest
from rig_sim.world import World

from rig.errors import ConfigError
from tests.support.cameras import SmallRig


def held_world(seed: int = 1) -> World:
    rig = SmallRig((f"world.seed={seed}",))
    return World(rig.profile, clock=rig.clock, carriage=rig.slide, scene="board", in_hand=True)


def test_a_hand_holds_the_board_still_then_elsewhere_and_tilts_it_to_all_sides():
    world, config = held_world(), held_world().config.hand
    period_s = config.move_s + config.hold_s
    poses = []
    for number in range(40):
        rest_s = number * period_s + config.move_s
        first, last = world.moment(rest_s + 0.01).board, world.moment(rest_s + 0.8).board
        assert first is not None
        assert first == last
        poses.append([*first.centre_mm, *first.rotation_deg])
        camera = world.moment(0.0).cameras[0]
        outline = camera.pixels(first.in_world_mm(first.outline_mm(2)))
        assert (outline.mean(axis=0) > 0).all()
        assert (outline.mean(axis=0) < [640, 400]).all()
    low, high = np.min(poses, axis=0), np.max(poses, axis=0)
    assert (high[3:5] > 15.0).all()
    assert (low[3:5] < -15.0).all()
    assert high[2] / low[2] > 1.8
    moving = {world.moment(period_s + t).board for t in (0.05, 0.1, 0.2)}
    assert len(moving) == 3


def test_the_same_seed_shows_the_same_poses():
    one, same, other = (held_world(seed).moment(5.0).board for seed in (1, 1, 2))
    assert one == same
    assert one != other


def test_a_hand_needs_a_target():
    rig = SmallRig()
    with pytest.raises(ConfigError, match=r"\[target\]"):
        World(
            rig.profile.model_copy(update={"target": None}),
            clock=rig.clock,
            carriage=rig.slide,
            scene="desk",
            in_hand=True,
        )
