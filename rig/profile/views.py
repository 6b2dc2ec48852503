"""Views in a profile: what each lens is called and where it is."""

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
