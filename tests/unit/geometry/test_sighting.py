"""Sightings refuse what no detector may hand over."""

import numpy as np
import pytest

from rig.errors import ConfigError
from rig.geometry.sighting import Sighting


def sighting(**changes: object) -> Sighting:
    values = {"ids": [0, 2], "xy_px": [[1.0, 2.0], [3.0, 4.0]], "sigma_px": [0.1, 0.1], **changes}
    return Sighting(3, 1, **{name: np.array(value) for name, value in values.items()})


def test_a_sighting_counts_its_points():
    assert len(sighting()) == 2


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"sigma_px": [0.1]}, "2 ids, 2 positions and 1 sigmas"),
        ({"ids": [4, 4]}, "there twice"),
        ({"ids": [-1, 4]}, "negative"),
        ({"xy_px": [[np.nan, 0.0], [1.0, 1.0]]}, "finite"),
        ({"sigma_px": [0.1, 0.0]}, "positive"),
    ],
)
def test_what_cannot_be_a_sighting_is_refused(changes: dict[str, object], says: str):
    with pytest.raises(ConfigError, match=says):
        sighting(**changes)
