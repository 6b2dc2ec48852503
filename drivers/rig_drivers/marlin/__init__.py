"""Marlin boards as a stage."""
