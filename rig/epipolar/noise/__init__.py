"""Noise: of one picture, of a sensor, between views and around a pixel."""
