"""Grids of circles: their layout, their blobs and their centres."""
