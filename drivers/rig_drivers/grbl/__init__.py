"""GRBL, grblHAL and FluidNC boards as a stage."""
