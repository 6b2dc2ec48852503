"""What hardly changes from one multi-view to the next: taken over, and measured anew in turn.

Gains belong to the cameras, noise and texture to the scene as a whole; where slopes are followed,
one of these things is measured in each frame, and the others are as they were. So each is at most
as many frames old as there are turns. A search of the whole range, which also comes wherever the
hypothesis is contradicted in many places, starts all of them afresh.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Float
from rig.epipolar.mending.gains import Gains
from rig.epipolar.scales import Grading

Map = NDArray[np.float32]

_GROWN, _GROWN_BY = 1.25, 0.002
"""Growth of the share of unknown pixels, as a factor and as a share, that is looked into at once.
"""

_MOST_UNKNOWN = 0.3
"""Share of unknown pixels from which the hypothesis is no guide, however often they were searched.
"""


class Turn(IntEnum):
    """What is measured anew."""

    GAINS = 0
    """Gain and offset of every view, and whether it shows the same scene."""
    NOISE = 1
    """Noise and texture, from which all grey scales follow."""
    DRIFT = 2
    """Light that changes with the view."""
    UNKNOWN = 3
    """The whole range, at the pixels that the hypothesis does not know."""


@dataclass(frozen=True, slots=True)
class Steady:
    """What one frame hands to the next beside its slopes."""

    x_steps: Float
    """(V,) the views that it is of, view steps."""
    y_steps: Float
    """(V,)."""
    gains: Gains
    """Of every view."""
    grading: Grading
    """Noise and texture."""
    pooled_share: float
    """See `rig.epipolar.noise.local.pooled_share`."""
    drift: Map | None
    """(2, H, W) as `rig.epipolar.drift.coarse_drift` has it; None where nothing drifts."""
    rival_px: Map
    """(H, W) second slopes that explained the views as well, NaN for none."""
    slope_px: Map
    """(H, W) what was found, also where it was no answer: the best guess where nothing is known."""
    wide_share: float
    """Share of the pixels that were unknown when they were last searched."""
    settled_share: float | None
    """Share of them in the first frame after a search of the whole range; None in that search."""
    turn: Turn
    """What is measured next."""

    def is_of(self, x_steps: Float, y_steps: Float) -> bool:
        """Whether it belongs to views at these places."""
        return np.array_equal(self.x_steps, x_steps) and np.array_equal(self.y_steps, y_steps)

    def is_due(self, what: Turn, share: float) -> bool:
        """Whether something is to be measured anew now.

        Args:
            what: the thing.
            share: of the pixels that are unknown now.
        """
        return what is self.turn or (what is Turn.UNKNOWN and share > _grown(self.wide_share))

    @property
    def most_followed(self) -> float:
        """Share of unknown pixels below which the hypothesis of the others is still followed."""
        if self.settled_share is None:
            return _MOST_UNKNOWN
        return min(_grown(self.settled_share), _MOST_UNKNOWN)

    def next_turn(self) -> Turn:
        """What is measured after that."""
        return Turn((self.turn + 1) % len(Turn))


def _grown(share: float) -> float:
    return _GROWN * share + _GROWN_BY
