"""The simulated camera on a slider, with pictures of a quarter of the size."""

SMALL_SCAN = (
    "world.renderer=analytic",
    "world.capture_scene=board",
    "camera.inner.width_px=160",
    "camera.inner.height_px=100",
    "world.optics.focal_px=152.5",
    "slopes.range_px=[1.7, 9.0]",
)
"""Overrides of profile `sim-scan`."""
SWEPT_SCAN = (
    "world.renderer=analytic",
    "camera.row.at_mm=[-20.0, 0.0, 12.5]",
    "camera.inner.width_px=320",
    "camera.inner.height_px=200",
    "world.optics.focal_px=305.0",
    "world.optics.blur_px=0.6",
    "slopes.range_px=[3.5, 18.0]",
)
"""Overrides with which three views see the board at every stop of a short sweep."""
