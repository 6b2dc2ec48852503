"""Aravis for tests, where it is installed."""

import pytest
from rig_genicam.aravis import load_aravis
from rig_genicam.aravis_library import AravisLibrary

from rig.errors import DeviceNotFoundError


def aravis_library() -> AravisLibrary:
    """The library; the test is skipped, and says why, where it is not there."""
    try:
        return AravisLibrary(load_aravis())
    except DeviceNotFoundError as error:
        pytest.skip(str(error))
