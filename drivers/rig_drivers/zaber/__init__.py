"""Zaber stages, by their ASCII protocol."""
