"""Views that have stopped: their picture is, bit for bit, the one before, while others changed.

A picture of a real sensor never repeats: its noise does not.
"""

import numpy as np

from rig.frames import MultiView


def frozen_views(before: MultiView | None, now: MultiView) -> tuple[int, ...]:
    """Indices of the views that show again what they showed in the last multi-view.

    Where every view repeats itself (stored pictures of a still scene), none is frozen.
    """
    if before is None:
        return ()
    same = tuple(
        i
        for i, (old, new) in enumerate(zip(before.frames, now.frames, strict=True))
        if np.array_equal(old.image, new.image)
    )
    return same if len(same) < len(now.frames) else ()
