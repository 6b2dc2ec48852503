"""A plug-in of pytest that the wheel brings: the fixture `rig_camera`.

It is loaded at every start of pytest: nothing is imported here that the fixture alone needs.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from rig.live.camera import DepthCamera


@pytest.fixture
def rig_camera() -> "Iterator[DepthCamera]":
    """A simulated rig with depth, open: five views of a board at 550 mm, no sweep and no render.

    Time is simulated: it passes as somebody waits for it.
    """
    from rig.testing.simulated import open_simulated_rig

    with open_simulated_rig() as camera:
        yield camera
