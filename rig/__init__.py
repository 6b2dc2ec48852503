"""rig: the bench tool that turns a multi-view camera into a calibrated depth camera."""

__version__ = "0.1.0"
