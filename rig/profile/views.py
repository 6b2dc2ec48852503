"""Views in a profile: what each lens is called and where it is."""

from collections.abc import Mapping
from typing import cast

from pydantic import Field

from rig.profile.model import Model


class ViewConfig(Model):
    """One view of the multi-view and its place."""

    name: str = Field(min_length=1, pattern=r"^[A-Za-z0-9_-]+$")
    """Short name; it appears in file names and messages."""
    x_steps: float
    """Place right of the reference view, in view steps (multiples of the pitch)."""
    y_steps: float
    """Place below the reference view, in view steps."""


def without_steps(profile: Mapping[str, object]) -> dict[str, object]:
    """Fill in what one view alone does not have: a place, steps, and slopes.

    Args:
        profile: as it stands in the file.
    """
    full = dict(profile)
    views = full.get("views")
    if not isinstance(views, list | tuple) or len(cast("list[object]", views)) != 1:
        return full
    (view,) = cast("list[object]", views)
    if isinstance(view, Mapping):
        full["views"] = [{"x_steps": 0.0, "y_steps": 0.0, **cast("Mapping[str, object]", view)}]
    return {"pitch_mm": 1.0, "slopes": {"range_px": [-1.0, 1.0]}, **full}
