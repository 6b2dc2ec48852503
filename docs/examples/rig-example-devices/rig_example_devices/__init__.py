"""Devices for rig that anybody can run: a camera that draws, and a stage that only counts."""
