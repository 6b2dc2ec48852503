"""Judgement of where the views stand: evenly spaced ones can agree on a wrong distance."""

from collections.abc import Sequence

import numpy as np

from rig.check.items import Item
from rig.profile import Profile

EVEN = 0.02
"""Departure from even spacing, in steps, that a dense search cannot tell from none."""


def judge_arrangement(profile: Profile) -> Item:
    """Judge the places of the views on their row and column.

    Where all views of a line stand on multiples of one spacing d, a pattern that repeats every p px
    looks the same at slopes that differ by p / d: the views agree on a wrong distance.
    """
    lines = {
        "row": [v.x_steps for v in profile.views if v.y_steps == 0.0],
        "column": [v.y_steps for v in profile.views if v.x_steps == 0.0],
    }
    used = {name: sorted(places) for name, places in lines.items() if len(places) > 1}
    shown = "; ".join(
        f"{name}: {', '.join(f'{p:+.2f}' for p in places)}" for name, places in used.items()
    )
    if not used:
        shown = f"{len(profile.views)} views on neither row nor column of the reference"
    even = [name for name, places in used.items() if len(places) > 2 and _is_even(places)]
    if even:
        return Item(
            "arrangement",
            "warn",
            f"views in steps, {shown}; evenly spaced: {' and '.join(even)}",
            "shift one view by a tenth of a step or more (and say so in the profile): uneven "
            "spacing keeps repeating patterns from looking right at a wrong distance",
        )
    pairs = [name for name, places in used.items() if len(places) == 2]
    note = ""
    if pairs and len(pairs) == len(used):
        note = "; two views to a line cannot tell a repeating pattern from its shift"
    return Item("arrangement", "pass", f"views in steps, {shown}{note}")


def _is_even(places: Sequence[float]) -> bool:
    spacing = np.diff(np.array(places))
    unit = float(spacing.min())
    if unit <= 0.0:
        return True
    multiples = spacing / unit
    return bool((np.abs(multiples - np.round(multiples)) * unit < EVEN).all())
