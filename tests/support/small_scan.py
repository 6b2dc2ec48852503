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
