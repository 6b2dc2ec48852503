"""The simulated rig with pictures of half the size: what the tests of whole runs use.

Everything that a picture shows is half as large, so distances and gates stay those of `sim`.
"""

SMALL_SIM = (
    "world.renderer=analytic",
    "camera.width_px=320",
    "camera.height_px=200",
    "world.optics.focal_px=305.0",
    "world.optics.blur_px=0.6",
    "slopes.range_px=[-9.0, 15.0]",
)
"""Overrides of profile `sim`."""

SMALL_PAIR = (
    *SMALL_SIM,
    "views=[{name='centre',x_steps=0,y_steps=0},{name='right',x_steps=0.93,y_steps=0}]",
    "world.view_errors={}",
)
"""The same with two of its views only: the least that is a rig."""


def as_options(overrides: tuple[str, ...] = SMALL_SIM) -> list[str]:
    """Return overrides as `--set` options of the command line."""
    return [word for override in overrides for word in ("--set", override)]
