"""Cameras behind an array of lenslets: where the micro-images lie, and the views inside them."""
